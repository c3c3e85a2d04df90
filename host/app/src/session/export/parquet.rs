//! The samples as typed columns.

use std::io::{Error, Result, Write};
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{BoolType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{ColumnPath, Type};

use super::column::{Column, ColumnType};
use super::entry::{Entry, Writer};
use super::shape::Shape;
use super::table::{TableName, Value};

/// Rows of a row group: what is held in memory, some 20 MB for six joints.
const GROUP_ROWS: usize = 1 << 17;

/// Writes Parquet, a row group at a time, with Snappy.
pub(super) struct ParquetWriter<W: Write + Send> {
    file: SerializedFileWriter<W>,
    columns: Vec<Buffer>,
    rows: usize,
}

/// A column's values in the row group that is being filled.
struct Buffer {
    /// For a column that may lack values: 1 where there is one, 0 where not.
    levels: Option<Vec<i16>>,
    values: Values,
}

enum Values {
    Int32(Vec<i32>),
    Int64(Vec<i64>),
    Flag(Vec<bool>),
    Double(Vec<f64>),
}

impl<W: Write + Send> ParquetWriter<W> {
    /// Begins the file.
    pub(super) fn new(out: W, shape: &Shape) -> Result<Self> {
        let columns = TableName::Samples.columns(shape);
        let fields = columns.iter().map(|column| field(column).map(Arc::new)).collect::<Result<_>>()?;
        let schema = Type::group_type_builder("samples").with_fields(fields).build().map_err(io_error)?;
        let facts = shape.facts(&columns).into_iter().map(|(key, value)| KeyValue::new(format!("ballbar.{key}"), value));
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_created_by(concat!("host-cal ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_key_value_metadata(Some(facts.collect()));
        for column in columns.iter().filter(|column| is_integer(column.column_type)) {
            // Counts and clocks change by little from row to row.
            let path = ColumnPath::from(column.name.as_str());
            properties = properties
                .set_column_dictionary_enabled(path.clone(), false)
                .set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
        }
        let file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties.build())).map_err(io_error)?;
        Ok(Self { file, columns: columns.iter().map(Buffer::new).collect(), rows: 0 })
    }

    fn write_group(&mut self) -> Result<()> {
        if self.rows == 0 {
            return Ok(());
        }
        let mut group = self.file.next_row_group().map_err(io_error)?;
        for buffer in &mut self.columns {
            let column = group.next_column().map_err(io_error)?;
            let Some(column) = column else { return Err(Error::other("the file has fewer columns than its table")) };
            buffer.write(column).map_err(io_error)?;
        }
        group.close().map_err(io_error)?;
        self.rows = 0;
        Ok(())
    }
}

impl<W: Write + Send> Writer for ParquetWriter<W> {
    fn take(&mut self, entry: &Entry) -> Result<()> {
        let Entry::Row { table: TableName::Samples, values, .. } = entry else { return Ok(()) };
        for (buffer, value) in self.columns.iter_mut().zip(*values) {
            buffer.push(*value);
        }
        self.rows += 1;
        if self.rows == GROUP_ROWS { self.write_group() } else { Ok(()) }
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.write_group()?;
        let mut out = self.file.into_inner().map_err(io_error)?;
        out.flush()
    }
}

impl Buffer {
    fn new(column: &Column) -> Self {
        let values = match column.column_type {
            ColumnType::Unsigned32 | ColumnType::Signed32 => Values::Int32(Vec::new()),
            ColumnType::Signed64 => Values::Int64(Vec::new()),
            ColumnType::Flag => Values::Flag(Vec::new()),
            ColumnType::Real { .. } => Values::Double(Vec::new()),
        };
        Self { levels: column.is_optional.then(Vec::new), values }
    }

    fn push(&mut self, value: Value) {
        match (&mut self.values, value) {
            // Parquet keeps the bits; the column's type says whether the highest is a sign.
            (Values::Int32(values), Value::Integer(number)) => values.push(number as i32),
            (Values::Int64(values), Value::Integer(number)) => values.push(number),
            (Values::Flag(values), Value::Flag(flag)) => values.push(flag),
            (Values::Double(values), Value::Real(number)) => values.push(number),
            _ => {
                self.levels.iter_mut().for_each(|levels| levels.push(0));
                return;
            }
        }
        self.levels.iter_mut().for_each(|levels| levels.push(1));
    }

    /// Writes the values and forgets them.
    fn write(&mut self, mut column: SerializedColumnWriter<'_>) -> parquet::errors::Result<()> {
        let levels = self.levels.as_deref();
        match &mut self.values {
            Values::Int32(values) => {
                column.typed::<Int32Type>().write_batch(values, levels, None)?;
                values.clear();
            }
            Values::Int64(values) => {
                column.typed::<Int64Type>().write_batch(values, levels, None)?;
                values.clear();
            }
            Values::Flag(values) => {
                column.typed::<BoolType>().write_batch(values, levels, None)?;
                values.clear();
            }
            Values::Double(values) => {
                column.typed::<DoubleType>().write_batch(values, levels, None)?;
                values.clear();
            }
        }
        self.levels.iter_mut().for_each(Vec::clear);
        column.close()
    }
}

fn is_integer(column_type: ColumnType) -> bool {
    matches!(column_type, ColumnType::Unsigned32 | ColumnType::Signed32 | ColumnType::Signed64)
}

fn field(column: &Column) -> Result<Type> {
    let (physical, logical) = match column.column_type {
        ColumnType::Unsigned32 => (PhysicalType::INT32, Some(LogicalType::integer(32, false))),
        ColumnType::Signed32 => (PhysicalType::INT32, None),
        ColumnType::Signed64 => (PhysicalType::INT64, None),
        ColumnType::Flag => (PhysicalType::BOOLEAN, None),
        ColumnType::Real { .. } => (PhysicalType::DOUBLE, None),
    };
    let repetition = if column.is_optional { Repetition::OPTIONAL } else { Repetition::REQUIRED };
    let field = Type::primitive_type_builder(&column.name, physical).with_repetition(repetition).with_logical_type(logical);
    field.build().map_err(io_error)
}

/// The system's own error where there is one inside.
fn io_error(error: ParquetError) -> Error {
    match error {
        ParquetError::External(inner) => inner.downcast::<Error>().map_or_else(Error::other, |error| *error),
        other => Error::other(other),
    }
}
