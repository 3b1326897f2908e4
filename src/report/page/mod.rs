//! The report of a result: one self-contained page, the answer first.
//!
//! A [`Page`] is data: sentences, tables, figures, in the order in which they are read. Commands make it
//! ([`diagnosis`], [`experiment`], [`calibration`], [`dataset`]), it is kept beside the results as `report.json`, and
//! [`Page::html`] draws it, now or later (`treadmark report`). Tables are those of the terminal.

pub mod calibration;
pub mod dataset;
pub mod diagnosis;
pub mod experiment;
mod figure;
mod html;
mod provenance;

pub use figure::{Bar, Bars, Hue, Mark, Plane, Scale, Shape};
pub use provenance::{Digest, DigestError, Provenance};

use super::grid::Grid;
use serde::{Deserialize, Serialize};

/// Format of `report.json`.
pub const FORMAT: &str = "treadmark-report/1";

/// A report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Page {
    /// [`FORMAT`]
    pub format: String,
    /// What was done, to what.
    pub title: String,
    /// The answer, in a sentence.
    pub answer: String,
    /// What follows from it, a sentence each.
    pub beside: Vec<String>,
    /// In reading order.
    pub sections: Vec<Section>,
    /// How to get it again.
    pub provenance: Provenance,
}

/// A part of a report, under a heading of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// The heading.
    pub heading: String,
    /// What is in it.
    pub blocks: Vec<Block>,
}

/// A piece of a section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// Short statements.
    List(Vec<String>),
    /// A table.
    Table(Grid),
    /// Figures of points and lines, side by side, with one key for all.
    Planes(Vec<Plane>),
    /// Figures of bars, side by side.
    Bars(Vec<Bars>),
    /// Something to paste: what it is, and the text.
    Paste(String, String),
}

impl Section {
    /// A section without those of its blocks that have nothing to show; `None` where that leaves nothing.
    fn of(heading: &str, blocks: Vec<Block>) -> Option<Section> {
        let blocks: Vec<Block> = blocks.into_iter().filter(|block| !block.is_empty()).collect();
        (!blocks.is_empty()).then(|| Section { heading: heading.to_owned(), blocks })
    }
}

impl Block {
    fn is_empty(&self) -> bool {
        match self {
            Block::Text(words) => words.is_empty(),
            Block::List(items) => items.is_empty(),
            Block::Table(grid) => grid.rows.is_empty(),
            Block::Planes(planes) => planes.is_empty(),
            Block::Bars(bars) => bars.iter().all(|bars| bars.rows.is_empty()),
            Block::Paste(_, text) => text.is_empty(),
        }
    }
}
