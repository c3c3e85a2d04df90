//! The samples as lines of text.

use std::io::{Result, Write};

use super::column::ColumnType;
use super::entry::{Entry, Writer};
use super::shape::Shape;
use super::table::{TableName, Value};

/// Writes CSV; what is unknown is empty, flags are 0 and 1.
pub(super) struct CsvWriter<W> {
    out: W,
    types: Vec<ColumnType>,
}

impl<W: Write> CsvWriter<W> {
    /// Writes the header.
    pub(super) fn new(mut out: W, shape: &Shape) -> Result<Self> {
        let columns = TableName::Samples.columns(shape);
        let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        writeln!(out, "{}", names.join(","))?;
        Ok(Self { out, types: columns.iter().map(|column| column.column_type).collect() })
    }
}

impl<W: Write> Writer for CsvWriter<W> {
    fn take(&mut self, entry: &Entry) -> Result<()> {
        let Entry::Row { table: TableName::Samples, values, .. } = entry else { return Ok(()) };
        for (i, (value, column_type)) in values.iter().zip(&self.types).enumerate() {
            if i > 0 {
                self.out.write_all(b",")?;
            }
            match (value, column_type) {
                (Value::Integer(number), _) => write!(self.out, "{number}")?,
                (Value::Flag(flag), _) => write!(self.out, "{}", u8::from(*flag))?,
                (Value::Real(number), ColumnType::Real { decimals }) => write!(self.out, "{number:.decimals$}")?,
                (Value::Real(number), _) => write!(self.out, "{number}")?,
                (Value::Unknown, _) => {}
            }
        }
        self.out.write_all(b"\n")
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.out.flush()
    }
}
