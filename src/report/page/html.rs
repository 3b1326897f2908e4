//! A page as one self-contained HTML file: no script, no font, no network.

use super::super::grid::Grid;
use super::figure::key;
use super::{Block, Page, Section};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Colours are those of Okabe and Ito, as in the recordings; the dark theme lifts them as far as contrast asks.
const STYLE: &str = include_str!("style.css");

impl Page {
    /// The file.
    pub fn html(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta name="generator" content=(format!("treadmark {}", self.provenance.version));
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    main {
                        header {
                            p.kicker { (self.title) }
                            h1 { (self.answer) }
                            @for words in &self.beside { p { (prose(words)) } }
                        }
                        @for section in &self.sections { (self::section(section)) }
                        (self.again())
                    }
                }
            }
        };
        page.into_string()
    }

    fn again(&self) -> Markup {
        let provenance = &self.provenance;
        html! {
            section {
                h2 { "How to get this again" }
                pre { code { (provenance.command) } }
                dl {
                    dt { "version" } dd { "treadmark " (provenance.version) }
                    @if let Some(seed) = provenance.seed { dt { "seed" } dd { (seed) } }
                    @for data in &provenance.data {
                        dt { (data.folder) }
                        dd { code.digest { (data.sha256) } }
                    }
                }
                @if let Some(first) = provenance.data.first() {
                    p.note { "Data digests are what " code { "sha256sum " (first.files.join(" ")) " | sha256sum" } " prints in the folder." }
                }
            }
        }
    }
}

fn section(section: &Section) -> Markup {
    html! {
        section {
            h2 { (section.heading) }
            @for block in &section.blocks { (self::block(block, &section.heading)) }
        }
    }
}

fn block(block: &Block, heading: &str) -> Markup {
    html! {
        @match block {
            Block::Text(words) => { p { (prose(words)) } }
            Block::List(items) => { ul { @for item in items { li { (prose(item)) } } } }
            Block::Table(grid) => { (table(grid, heading)) }
            Block::Planes(planes) => {
                (key(planes))
                div.figures {
                    @for plane in planes { figure { figcaption { (plane.title) } (plane.svg()) } }
                }
            }
            Block::Bars(bars) => {
                div.figures {
                    @for bars in bars.iter().filter(|bars| !bars.rows.is_empty()) {
                        figure { figcaption { (bars.title) } (bars.svg()) }
                    }
                }
            }
            Block::Paste(what, text) => { p { (what) } pre { code { (text) } } }
        }
    }
}

/// What stands between backticks is code.
fn prose(words: &str) -> Markup {
    html! {
        @for (index, part) in words.split('`').enumerate() {
            @if index % 2 == 0 { (part) } @else { code { (part) } }
        }
    }
}

/// Long names may break after an underscore.
fn breakable(name: &str) -> Markup {
    html! { @for (index, part) in name.split('_').enumerate() { @if index > 0 { "_" wbr; } (part) } }
}

fn table(grid: &Grid, heading: &str) -> Markup {
    html! {
        @if !grid.title.is_empty() && grid.title != heading { h3 { (grid.title) } }
        // On a phone a wide table scrolls by itself, the page does not.
        div.scroll {
            table {
                thead { tr { @for (index, name) in grid.header.iter().enumerate() { th.words[grid.is_words(index)] scope="col" { (name) } } } }
                tbody {
                    @for row in &grid.rows { tr { @for (index, cell) in row.iter().enumerate() {
                        @if index == 0 { th scope="row" { (breakable(cell)) } } @else { td.words[grid.is_words(index)] { (cell) } }
                    } } }
                }
            }
        }
        @if !grid.note.is_empty() { p.note { (grid.note) } }
    }
}
