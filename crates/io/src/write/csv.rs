//! Tables of numbers as CSV (RFC 4180, lines ended by a line feed).

use super::{AtomicFile, WriteError};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A table written row by row; it appears under its name at [`CsvWriter::finish`] and not before.
///
/// Numbers are printed in the fewest digits that read back as the same f64, integers without a point, very large and
/// very small ones with an exponent (`1.5e-9`).
///
/// ```
/// use ondelette_io::write::CsvWriter;
/// let folder = tempfile::tempdir().unwrap();
/// let path = folder.path().join("t.csv");
/// let mut table = CsvWriter::create(&path, &["x", "irradiance_r"]).unwrap();
/// table.row(&[0.1, 3.0]).unwrap();
/// table.finish().unwrap();
/// assert_eq!(std::fs::read_to_string(&path).unwrap(), "x,irradiance_r\n0.1,3\n");
/// ```
#[derive(Debug)]
pub struct CsvWriter {
    file: AtomicFile,
    path: PathBuf,
    columns: usize,
    rows: usize,
    line: String,
}

/// One cell of a row that does not hold numbers alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell<'a> {
    /// A finite number.
    Number(f64),
    /// A name; put in quotes where it must be.
    Text(&'a str),
    /// Nothing: the column does not apply to this row.
    Empty,
}

impl CsvWriter {
    /// Starts the table `path` with its header line.
    ///
    /// # Errors
    /// As [`AtomicFile::create`]; a header without columns.
    pub fn create(path: &Path, header: &[&str]) -> Result<Self, WriteError> {
        if header.is_empty() {
            return Err(WriteError::data(path, "a table needs at least one column"));
        }
        let file = AtomicFile::create(path)?;
        let columns = header.len();
        let mut table = CsvWriter { file, path: path.to_path_buf(), columns, rows: 0, line: String::new() };
        let header: Vec<String> = header.iter().map(|name| quoted(name)).collect();
        table.line = header.join(",");
        table.put_line()?;
        Ok(table)
    }

    /// Adds one row of numbers.
    ///
    /// # Errors
    /// The number of values is not that of the header, a value is not finite, or the disk refuses.
    pub fn row(&mut self, values: &[f64]) -> Result<(), WriteError> {
        self.put_row(values.iter().map(|&value| Cell::Number(value)))
    }

    /// Adds one row of numbers, texts and gaps.
    ///
    /// # Errors
    /// As [`CsvWriter::row`].
    pub fn row_of(&mut self, cells: &[Cell<'_>]) -> Result<(), WriteError> {
        self.put_row(cells.iter().copied())
    }

    fn put_row<'a>(&mut self, cells: impl ExactSizeIterator<Item = Cell<'a>>) -> Result<(), WriteError> {
        if cells.len() != self.columns {
            let reason = format!("row {} has {} values, the header {}", self.rows + 1, cells.len(), self.columns);
            return Err(WriteError::data(&self.path, reason));
        }
        self.line.clear();
        for (i, cell) in cells.enumerate() {
            if i > 0 {
                self.line.push(',');
            }
            match cell {
                Cell::Number(value) if value.is_finite() => push_shortest(&mut self.line, value),
                Cell::Number(value) => {
                    let reason = format!("row {}, column {}: the value is {value}", self.rows + 1, i + 1);
                    return Err(WriteError::data(&self.path, reason));
                }
                Cell::Text(text) => self.line.push_str(&quoted(text)),
                Cell::Empty => {}
            }
        }
        self.rows += 1;
        self.put_line()
    }

    /// Gives the finished table its name.
    ///
    /// # Errors
    /// As [`AtomicFile::commit`].
    pub fn finish(self) -> Result<(), WriteError> {
        self.file.commit()
    }

    fn put_line(&mut self) -> Result<(), WriteError> {
        self.line.push('\n');
        self.file.write_all(self.line.as_bytes()).map_err(|e| self.file.refused("writing", e))
    }
}

/// Appends a row of numbers to `text` as [`CsvWriter::row`] writes it, and `gaps` empty cells: for tables whose rows
/// are printed in parallel and for standard output. The numbers are taken as they are.
///
/// ```
/// let mut text = String::new();
/// ondelette_io::write::push_row(&mut text, &[0.25, 1e-9], 1);
/// assert_eq!(text, "0.25,1e-9,\n");
/// ```
pub fn push_row(text: &mut String, values: &[f64], gaps: usize) {
    for (i, value) in values.iter().enumerate() {
        if i > 0 {
            text.push(',');
        }
        push_shortest(text, *value);
    }
    text.extend(std::iter::repeat_n(',', gaps));
    text.push('\n');
}

/// Appends the shortest decimal that reads back as the same number.
fn push_shortest(text: &mut String, value: f64) {
    use std::fmt::Write;
    let size = value.abs();
    // Writing to a String does not fail.
    let _ =
        if value == 0.0 || (1e-5..1e16).contains(&size) { write!(text, "{value}") } else { write!(text, "{value:e}") };
}

/// A header cell, in quotes where RFC 4180 wants them.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_read_back_to_the_bit(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            if value.is_finite() {
                let mut text = String::new();
                push_shortest(&mut text, value);
                prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), bits);
                prop_assert!(text.len() <= 24, "{} is not short", text);
            }
        }
    }

    #[test]
    fn a_wrong_row_is_refused_by_number_and_no_table_appears() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("links.csv");
        let mut table = CsvWriter::create(&path, &["a", "b"]).unwrap();
        table.row(&[1.0, 2.0]).unwrap();
        let short = table.row(&[1.0]).unwrap_err().to_string();
        assert!(short.contains("row 2 has 1 values, the header 2"), "{short}");
        let nan = table.row(&[1.0, f64::NAN]).unwrap_err().to_string();
        assert!(nan.contains("row 2, column 2") && nan.contains("NaN"), "{nan}");
        drop(table);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn names_and_gaps_keep_their_columns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("elements.csv");
        let mut table = CsvWriter::create(&path, &["object", "level", "area, m^2"]).unwrap();
        table.row_of(&[Cell::Text("wall, left"), Cell::Number(3.0), Cell::Number(1e-9)]).unwrap();
        table.row_of(&[Cell::Text("lamp"), Cell::Empty, Cell::Number(0.25)]).unwrap();
        table.finish().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "object,level,\"area, m^2\"\n\"wall, left\",3,1e-9\nlamp,,0.25\n");
    }

    #[test]
    fn headers_with_commas_stay_one_column() {
        assert_eq!(quoted("E, red"), "\"E, red\"");
        assert_eq!(quoted("a \"b\""), "\"a \"\"b\"\"\"");
        assert_eq!(quoted("plain"), "plain");
    }
}
