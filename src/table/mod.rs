//! Tables: typed columns whose names carry their units, and the Parquet file that they are kept in.
//!
//! The same table gives the same bytes: nothing in the file depends on the clock, the machine or the threads.

mod parquet_file;

pub use parquet_file::TableError;

/// What a column holds. Any cell may be absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Real numbers in the unit that the column's name ends in.
    Number,
    /// Whole numbers, 0 or above.
    Whole,
    /// Text.
    Text,
}

/// A column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// With its unit: `true_end_x_m`.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
}

/// One value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Of a [`Kind::Number`] column; finite, since a table's reader cannot tell infinite from broken.
    Number(f64),
    /// Of a [`Kind::Whole`] column.
    Whole(u64),
    /// Of a [`Kind::Text`] column.
    Text(String),
    /// Nothing.
    Absent,
}

impl Column {
    /// A column of real numbers.
    pub fn number(name: impl Into<String>) -> Column {
        Column { name: name.into(), kind: Kind::Number }
    }

    /// A column of whole numbers.
    pub fn whole(name: impl Into<String>) -> Column {
        Column { name: name.into(), kind: Kind::Whole }
    }

    /// A column of text.
    pub fn text(name: impl Into<String>) -> Column {
        Column { name: name.into(), kind: Kind::Text }
    }
}

impl Cell {
    /// `value`, or nothing where it is not finite.
    pub fn number(value: f64) -> Cell {
        if value.is_finite() { Cell::Number(value) } else { Cell::Absent }
    }
}

/// Rows under columns, and what else a reader has to know.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// In their order.
    pub columns: Vec<Column>,
    /// One cell a column each.
    pub rows: Vec<Vec<Cell>>,
    /// Key and value, kept inside the file.
    pub notes: Vec<(String, String)>,
}
