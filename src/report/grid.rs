//! A table before it is drawn: the terminal, the recording and the HTML report show the same words in the same order.

use super::text::{Style, table};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// A table with what stands above and below it. Its first column names, the others hold numbers.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Grid {
    /// What it shows, with units where all columns share one.
    pub title: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Cells, row by row.
    pub rows: Vec<Vec<String>>,
    /// What one has to know to read it; may be empty.
    pub note: String,
}

impl Grid {
    /// A table without rows.
    pub fn new(title: impl Into<String>, header: &[&str]) -> Grid {
        let header = header.iter().map(|&name| name.to_owned()).collect();
        Grid { title: title.into(), header, rows: Vec::new(), note: String::new() }
    }

    /// Appends a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// The same with a note below.
    pub fn noted(self, note: impl Into<String>) -> Grid {
        Grid { note: note.into(), ..self }
    }

    /// Whether a column holds words; they begin at the left.
    pub fn is_words(&self, column: usize) -> bool {
        let number = |cell: &str| cell.starts_with(|c: char| c.is_ascii_digit() || "-+−–<>".contains(c));
        column == 0 || !self.rows.iter().any(|row| row.get(column).is_some_and(|cell| number(cell)))
    }

    /// As text, with a blank line after it.
    pub fn draw(&self, style: Style) -> String {
        let mut text = String::new();
        let markdown = style == Style::Markdown;
        if !self.title.is_empty() {
            let _ = writeln!(text, "{}{}", if markdown { "### " } else { "" }, self.title);
        }
        if markdown {
            text.push('\n');
        }
        let header: Vec<&str> = self.header.iter().map(String::as_str).collect();
        let mut table = table(style, &header);
        for (index, column) in table.column_iter_mut().enumerate() {
            if self.is_words(index) {
                column.set_cell_alignment(comfy_table::CellAlignment::Left);
            }
        }
        table.add_rows(self.rows.iter().cloned());
        let _ = writeln!(text, "{table}");
        if markdown {
            text.push('\n');
        }
        if !self.note.is_empty() {
            let _ = writeln!(text, "{}", self.note);
        }
        text.push('\n');
        text
    }
}
