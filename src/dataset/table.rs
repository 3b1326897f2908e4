//! A CSV file taken apart: a header whose columns are known, and cells that know where they stand.

use super::SurveyedPose;
use super::error::{CsvProblem, DatasetError};
use std::path::{Path, PathBuf};

/// A CSV file whose header has been taken apart.
pub(super) struct Table {
    path: PathBuf,
    header_line: u64,
    columns: Vec<String>,
    rows: Vec<(u64, csv::StringRecord)>,
}

/// One row of a table.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    table: &'a Table,
    line: u64,
    record: &'a csv::StringRecord,
}

impl Table {
    /// Takes `text` apart; `path` and `header`, what its header looks like, are for messages.
    pub(super) fn parse(path: &Path, text: &str, header: &'static str) -> Result<Table, DatasetError> {
        let fails = |line, problem| DatasetError::Csv { path: path.to_owned(), line, problem };
        let text = text.trim_start_matches('\u{feff}');
        let Some(first) = text.lines().find(|line| !line.trim().is_empty()) else {
            return Err(fails(1, CsvProblem::Empty { expected: header }));
        };
        let separator = [(';', "semicolons"), ('\t', "tabs")]
            .into_iter()
            .find(|(separator, _)| !first.contains(',') && first.contains(*separator));
        if let Some((_, found)) = separator {
            return Err(fails(1, CsvProblem::Separator { found }));
        }

        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut header_line = 1;
        let mut columns: Vec<String> = Vec::new();
        let mut rows = Vec::new();
        let mut record = csv::StringRecord::new();
        // A flexible record of UTF-8 in memory has no way to fail; were it to, the reason would be one of reading.
        let failed = |error: csv::Error| DatasetError::Read { path: path.to_owned(), source: error.into() };
        while reader.read_record(&mut record).map_err(failed)? {
            let line = line_of(text, &record);
            if record.iter().any(|cell| cell.contains(['\n', '\r'])) {
                return Err(fails(line, CsvProblem::LineBreak));
            }
            if record.iter().all(str::is_empty) {
                continue;
            }
            if columns.is_empty() {
                header_line = line;
                columns = record.iter().map(str::to_owned).collect();
                let twice = columns.iter().enumerate().find(|(index, column)| columns[..*index].contains(column));
                if let Some((_, column)) = twice {
                    return Err(fails(line, CsvProblem::DuplicateColumn { column: column.clone() }));
                }
                continue;
            }
            if record.len() != columns.len() {
                return Err(fails(line, CsvProblem::Ragged { found: record.len(), expected: columns.len() }));
            }
            rows.push((line, record.clone()));
        }
        Ok(Table { path: path.to_owned(), header_line, columns, rows })
    }

    /// The names of the header, in file order.
    pub(super) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The rows below the header.
    pub(super) fn rows(&self) -> impl ExactSizeIterator<Item = Row<'_>> {
        self.rows.iter().map(|(line, record)| Row { table: self, line: *line, record })
    }

    /// Checks that every column is one of `known`, and that the first `required` of them are there.
    pub(super) fn expect_columns(&self, known: &[&'static str], required: usize) -> Result<(), DatasetError> {
        if let Some(column) = self.columns.iter().find(|column| !known.contains(&column.as_str())) {
            return Err(self.fails(CsvProblem::UnknownColumn { column: column.clone(), known: known.to_vec() }));
        }
        known[..required].iter().try_for_each(|column| self.require(column))
    }

    /// Checks that `column` is there.
    pub(super) fn require(&self, column: &'static str) -> Result<(), DatasetError> {
        match self.position(column) {
            Some(_) => Ok(()),
            None => Err(self.fails(CsvProblem::MissingColumn { column })),
        }
    }

    /// An error of the header.
    pub(super) fn fails(&self, problem: CsvProblem) -> DatasetError {
        DatasetError::Csv { path: self.path.clone(), line: self.header_line, problem }
    }

    fn position(&self, column: &str) -> Option<usize> {
        self.columns.iter().position(|name| name == column)
    }
}

/// The line of the file on which `record` begins. The parser's own position stands before the blank lines that it skips.
fn line_of(text: &str, record: &csv::StringRecord) -> u64 {
    let Some(position) = record.position() else { return 1 };
    let rest = usize::try_from(position.byte()).ok().and_then(|byte| text.get(byte..)).unwrap_or("");
    let skipped = rest.bytes().take_while(|byte| matches!(byte, b'\r' | b'\n')).filter(|byte| *byte == b'\n').count();
    position.line() + skipped as u64
}

impl<'a> Row<'a> {
    /// The line of the file, from 1.
    pub(super) fn line(&self) -> u64 {
        self.line
    }

    /// The cell under `column`; blank where there is no such column.
    pub(super) fn text(&self, column: &str) -> &'a str {
        self.table.position(column).map_or("", |position| &self.record[position])
    }

    /// The number under `column`; `None` where it is blank.
    pub(super) fn number(&self, column: &str) -> Result<Option<f64>, DatasetError> {
        let text = self.text(column);
        if text.is_empty() {
            return Ok(None);
        }
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ if text.contains(',') => {
                Err(self.not_allowed(column, "a finite number with a decimal point, not a comma"))
            }
            _ => Err(self.not_allowed(column, "a finite number")),
        }
    }

    /// The number under `column`, which must not be blank; `why` says what it is for.
    pub(super) fn required(&self, column: &str, why: &'static str) -> Result<f64, DatasetError> {
        self.number(column)?.ok_or_else(|| self.blank(column, why))
    }

    /// The number under `column`, above 0; `None` where it is blank.
    pub(super) fn positive(&self, column: &str) -> Result<Option<f64>, DatasetError> {
        match self.number(column)? {
            Some(value) if value <= 0.0 => Err(self.not_allowed(column, "a number above 0")),
            value => Ok(value),
        }
    }

    /// The number under `column`, above 0, which must not be blank; `why` says what it is for.
    pub(super) fn required_positive(&self, column: &str, why: &'static str) -> Result<f64, DatasetError> {
        self.positive(column)?.ok_or_else(|| self.blank(column, why))
    }

    /// Position and heading under three columns; a position is whole, and a heading has one.
    pub(super) fn pose(&self, columns: [&'static str; 3]) -> Result<Option<SurveyedPose>, DatasetError> {
        let [x, y, heading] = columns;
        let together = |blank, filled| DatasetError::Together {
            path: self.table.path.clone(),
            line: self.line,
            blank,
            filled,
            value: self.text(filled).to_owned(),
        };
        match (self.number(x)?, self.number(y)?, self.number(heading)?) {
            (Some(x), Some(y), heading) => Ok(Some(SurveyedPose { x, y, heading })),
            (None, None, None) => Ok(None),
            (None, Some(_), _) => Err(together(x, y)),
            (Some(_), None, _) => Err(together(y, x)),
            (None, None, Some(_)) => Err(together(x, heading)),
        }
    }

    /// The value under `column` is not allowed; `allowed` says what is.
    pub(super) fn not_allowed(&self, column: &str, allowed: impl Into<String>) -> DatasetError {
        DatasetError::Value {
            path: self.table.path.clone(),
            line: self.line,
            column: column.to_owned(),
            value: self.text(column).to_owned(),
            allowed: allowed.into(),
        }
    }

    /// The cell under `column` is blank and must not be; `why` says what it is for.
    pub(super) fn blank(&self, column: &str, why: &'static str) -> DatasetError {
        DatasetError::Blank { path: self.table.path.clone(), line: self.line, column: column.to_owned(), why }
    }
}
