//! A table as a Parquet file, by the column writers of the `parquet` crate (no Arrow between).

use super::{Cell, Kind, Table};
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows of a row group: what a reader takes into memory at once.
const GROUP: usize = 65_536;

/// A table that could not be kept.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The writer of columns.
    #[error("the table cannot be put into Parquet: {0}")]
    Parquet(#[from] ParquetError),
    /// The file system.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Another result stands there.
    #[error("{}: holds another table already, and results are never overwritten", file.display())]
    Exists {
        /// The file.
        file: PathBuf,
    },
    /// A row with a cell that its column does not hold, or without one cell a column.
    #[error("row {row} of the table does not fit its columns")]
    Misfit {
        /// From 0.
        row: usize,
    },
}

impl Table {
    /// The bytes of the Parquet file: the same for the same table.
    ///
    /// # Errors
    /// A row that does not fit the columns, or what the writer says.
    pub fn to_parquet(&self) -> Result<Vec<u8>, TableError> {
        if let Some(row) = self.rows.iter().position(|row| !self.fits(row)) {
            return Err(TableError::Misfit { row });
        }
        let fields = self.columns.iter().map(|column| field(&column.name, column.kind).map(Arc::new));
        let fields = fields.collect::<Result<Vec<_>, ParquetError>>()?;
        let schema = Type::group_type_builder("schema").with_fields(fields).build()?;
        let notes = self.notes.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).collect();
        let properties = WriterProperties::builder()
            .set_created_by(concat!("treadmark ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(notes))
            .build();
        let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
        for rows in self.rows.chunks(GROUP) {
            let mut group = writer.next_row_group()?;
            for (index, column) in self.columns.iter().enumerate() {
                write_column(&mut group, column.kind, rows.iter().map(|row| &row[index]))?;
            }
            group.close()?;
        }
        Ok(writer.into_inner()?)
    }

    /// Writes the file whole or not at all. One that is there already with the same bytes will do; another is left alone.
    ///
    /// # Errors
    /// It cannot be written, or another table stands there.
    pub fn write(&self, file: &Path) -> Result<(), TableError> {
        use std::io::Write;
        let failed = |source| TableError::Io { file: file.to_owned(), source };
        let bytes = self.to_parquet()?;
        if file.exists() {
            let there = std::fs::read(file).map_err(failed)?;
            return if there == bytes { Ok(()) } else { Err(TableError::Exists { file: file.to_owned() }) };
        }
        // Not a temporary file of the system's: that would be nobody else's to read.
        let part = file.with_extension("parquet.part");
        let mut open = std::fs::File::create(&part).map_err(failed)?;
        open.write_all(&bytes).map_err(failed)?;
        open.sync_all().map_err(failed)?;
        std::fs::rename(&part, file).map_err(failed)
    }

    fn fits(&self, row: &[Cell]) -> bool {
        let cell_fits = |cell: &Cell, kind: Kind| {
            matches!(
                (cell, kind),
                (Cell::Absent, _)
                    | (Cell::Number(_), Kind::Number)
                    | (Cell::Whole(_), Kind::Whole)
                    | (Cell::Text(_), Kind::Text)
            )
        };
        row.len() == self.columns.len()
            && row.iter().zip(&self.columns).all(|(cell, column)| cell_fits(cell, column.kind))
    }
}

fn field(name: &str, kind: Kind) -> Result<Type, ParquetError> {
    let (physical, logical) = match kind {
        Kind::Number => (Physical::DOUBLE, None),
        Kind::Whole => (Physical::INT64, Some(LogicalType::integer(64, false))),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()
}

/// One column of a row group: a definition level a row, a value where there is one.
fn write_column<'a>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    kind: Kind,
    cells: impl Iterator<Item = &'a Cell> + Clone,
) -> Result<(), ParquetError> {
    let Some(mut writer) = group.next_column()? else { return Ok(()) };
    let levels: Vec<i16> = cells.clone().map(|cell| i16::from(*cell != Cell::Absent)).collect();
    match kind {
        Kind::Number => {
            let value = |cell: &Cell| if let Cell::Number(value) = cell { Some(*value) } else { None };
            let values: Vec<f64> = cells.filter_map(value).collect();
            writer.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
        }
        Kind::Whole => {
            // Parquet keeps unsigned numbers in the bits of signed ones; the logical type says so.
            let value = |cell: &Cell| if let Cell::Whole(value) = cell { Some(*value as i64) } else { None };
            let values: Vec<i64> = cells.filter_map(value).collect();
            writer.typed::<Int64Type>().write_batch(&values, Some(&levels), None)?;
        }
        Kind::Text => {
            let value =
                |cell: &Cell| if let Cell::Text(text) = cell { Some(ByteArray::from(text.as_str())) } else { None };
            let values: Vec<ByteArray> = cells.filter_map(value).collect();
            writer.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
        }
    }
    writer.close()
}
