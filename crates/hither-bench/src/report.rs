//! What was measured, as aligned text and as JSON.

use serde_json::{Map, Value, json};
use std::fmt::{self, Write};

/// Everything that one run measured.
#[derive(Clone, Debug)]
pub struct Report {
    /// Name of the processor, if it is known.
    pub processor: String,
    /// How many threads the machine runs at once.
    pub cores: usize,
    /// Instruction set that was used.
    pub instruction_set: String,
    /// The tables, in the order in which they were made.
    pub tables: Vec<Table>,
}

/// A table: every row has a cell for every column.
#[derive(Clone, Debug)]
pub struct Table {
    /// Name to ask for it by.
    pub name: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows.
    pub rows: Vec<Vec<Cell>>,
    /// What must be known to read it.
    pub notes: Vec<String>,
}

/// A column of a table.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Key in JSON; ends in `_ms` for milliseconds.
    pub key: &'static str,
    /// Heading.
    pub title: &'static str,
    /// Digits after the point, in text.
    pub digits: usize,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number.
    Number(f64),
    /// Not measured.
    Nothing,
}

impl From<&str> for Cell {
    fn from(text: &str) -> Cell {
        Cell::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Cell {
        Cell::Text(text)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Cell {
        Cell::Number(number)
    }
}

impl From<u64> for Cell {
    fn from(number: u64) -> Cell {
        Cell::Number(number as f64)
    }
}

impl From<usize> for Cell {
    fn from(number: usize) -> Cell {
        Cell::Number(number as f64)
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Cell {
        value.map_or(Cell::Nothing, Into::into)
    }
}

impl Table {
    pub(crate) fn new(name: &'static str, title: &'static str, columns: &[Column]) -> Table {
        Table { name, title, columns: columns.to_vec(), rows: Vec::new(), notes: Vec::new() }
    }

    pub(crate) fn push(&mut self, row: impl Into<Vec<Cell>>) {
        let row = row.into();
        assert_eq!(row.len(), self.columns.len(), "a row of table {} does not fit", self.name);
        self.rows.push(row);
    }

    fn json(&self) -> Value {
        let row = |cells: &Vec<Cell>| -> Value {
            let mut object = Map::new();
            for (column, cell) in self.columns.iter().zip(cells) {
                let value = match cell {
                    Cell::Text(text) => json!(text),
                    Cell::Number(number) => json!(number),
                    Cell::Nothing => Value::Null,
                };
                object.insert(column.key.to_owned(), value);
            }
            Value::Object(object)
        };
        let rows: Vec<Value> = self.rows.iter().map(row).collect();
        json!({ "name": self.name, "title": self.title, "rows": rows, "notes": self.notes })
    }
}

impl Report {
    pub(crate) fn of_this_machine(instruction_set: String) -> Report {
        let processor = std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("model name"))?;
            line.split_once(':').map(|(_, name)| name.trim().to_owned())
        });
        Report {
            processor: processor.unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            instruction_set,
            tables: Vec::new(),
        }
    }

    /// The report as JSON, schema `hither.bench/1`.
    pub fn to_json(&self) -> Value {
        let tables: Vec<Value> = self.tables.iter().map(Table::json).collect();
        json!({
            "schema": "hither.bench/1",
            "version": hither::VERSION,
            "machine": {
                "processor": self.processor,
                "cores": self.cores,
                "instruction_set": self.instruction_set,
            },
            "tables": tables,
        })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}, {} threads, {}", self.processor, self.cores, self.instruction_set)?;
        for table in &self.tables {
            write!(f, "\n{table}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {}", self.name, self.title)?;
        let text = |cell: &Cell, column: &Column| match cell {
            Cell::Text(text) => text.clone(),
            Cell::Number(number) => grouped(*number, column.digits),
            Cell::Nothing => "–".to_owned(),
        };
        let rows: Vec<Vec<String>> = self
            .rows
            .iter()
            .map(|r| r.iter().zip(&self.columns).map(|(c, k)| text(c, k)).collect())
            .collect();
        let width = |at: usize| {
            let cells = rows.iter().map(|r| r[at].chars().count());
            cells.chain([self.columns[at].title.chars().count()]).max().unwrap_or(0)
        };
        let is_text = |at: usize| self.rows.iter().any(|r| matches!(r[at], Cell::Text(_)));
        let mut lines = String::new();
        let headings: Vec<String> = self.columns.iter().map(|c| c.title.to_owned()).collect();
        for row in [&headings].into_iter().chain(&rows) {
            let mut line = String::new();
            for (at, cell) in row.iter().enumerate() {
                let w = width(at);
                if is_text(at) {
                    write!(line, "  {cell:<w$}")?;
                } else {
                    write!(line, "  {cell:>w$}")?;
                }
            }
            writeln!(lines, "{}", line.trim_end())?;
        }
        f.write_str(&lines)?;
        for note in &self.notes {
            writeln!(f, "  {note}")?;
        }
        Ok(())
    }
}

/// With thin groups of three: 539,055,000.
fn grouped(number: f64, digits: usize) -> String {
    let plain = format!("{:.digits$}", number.abs());
    let (whole, fraction) = plain.split_once('.').unwrap_or((&plain, ""));
    let mut text = String::new();
    if number < 0.0 {
        text.push('-');
    }
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    if !fraction.is_empty() {
        text.push('.');
        text.push_str(fraction);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_line_up_and_json_has_a_key_for_every_cell() {
        let columns = [
            Column { key: "scene", title: "scene", digits: 0 },
            Column { key: "time_ms", title: "ms", digits: 2 },
        ];
        let mut table = Table::new("t", "times", &columns);
        table.push([Cell::from("office"), Cell::from(1234.5)]);
        table.push([Cell::from("city"), Cell::Nothing]);
        assert_eq!(
            table.to_string(),
            "t: times\n  scene         ms\n  office  1,234.50\n  city           –\n"
        );
        let report = Report { tables: vec![table], ..Report::of_this_machine("portable".to_owned()) };
        let json = report.to_json();
        assert_eq!(json["schema"], "hither.bench/1");
        assert_eq!(json["tables"][0]["rows"][0]["time_ms"], 1234.5);
        assert!(json["tables"][0]["rows"][1]["time_ms"].is_null());
    }

    #[test]
    fn numbers_are_grouped() {
        assert_eq!(grouped(539_055_000.0, 0), "539,055,000");
        assert_eq!(grouped(-12.345, 2), "-12.35");
        assert_eq!(grouped(999.999, 1), "1,000.0");
    }
}
