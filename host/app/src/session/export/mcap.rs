//! Everything that a log holds, as timed messages for Foxglove and other readers of MCAP.
//!
//! Messages are JSON with schemas. Rows of a table have its columns as keys; what is unknown is left out. What Foxglove has a kind of
//! its own for is given as that: tool poses as `foxglove.PoseInFrame`, what happened as `foxglove.Log` (schemas written here from
//! the fields that Foxglove's documentation gives).

use std::collections::BTreeMap;
use std::io::{Error, Result, Seek, Write};

use ballbar::wire::ToolPose;
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::Serialize;
use serde_json::{Value as Json, json};

use super::column::{Column, ColumnType};
use super::entry::{Entry, Writer};
use super::shape::Shape;
use super::stamp::Stamp;
use super::table::{TableName, Value};

/// Bytes of a chunk: what is held in memory.
const CHUNK_BYTES: u64 = 4 << 20;
/// Frame of the robot's base, in which the tool's poses are.
const BASE_FRAME: &str = "base";
/// Levels of `foxglove.Log`.
const INFO: u8 = 2;
const WARNING: u8 = 3;

/// Writes MCAP in chunks, without compression.
pub(super) struct McapWriter<W: Write + Seek> {
    file: mcap::Writer<W>,
    samples: TableChannel,
    settled: TableChannel,
    bar: TableChannel,
    tool_pose: u16,
    notes: u16,
    facts: BTreeMap<String, String>,
    /// The message being made.
    message: Vec<u8>,
}

/// The channel of a table.
struct TableChannel {
    id: u16,
    /// What stands before each value: a comma, and the column's name.
    keys: Vec<String>,
}

impl<W: Write + Seek> McapWriter<W> {
    /// Begins the file.
    pub(super) fn new(out: W, shape: &Shape) -> Result<Self> {
        let options = WriteOptions::new()
            .library(concat!("host-cal ", env!("CARGO_PKG_VERSION")))
            .compression(None)
            .chunk_size(Some(CHUNK_BYTES));
        let mut file = options.create(out).map_err(io_error)?;
        let samples = table(&mut file, shape, TableName::Samples)?;
        let settled = table(&mut file, shape, TableName::Settled)?;
        let bar = table(&mut file, shape, TableName::Bar)?;
        let tool_pose = channel(&mut file, "/tool_pose", "foxglove.PoseInFrame", &pose_schema())?;
        let notes = channel(&mut file, "/log", "foxglove.Log", &log_schema())?;
        let facts = shape.facts(&TableName::Samples.columns(shape));
        Ok(Self { file, samples, settled, bar, tool_pose, notes, facts, message: Vec::new() })
    }

    fn row(&mut self, table: TableName, stamp: &Stamp, values: &[Value]) -> Result<()> {
        let channel = match table {
            TableName::Samples => &self.samples,
            TableName::Settled => &self.settled,
            TableName::Bar => &self.bar,
        };
        let (id, message) = (channel.id, &mut self.message);
        message.clear();
        for (key, value) in channel.keys.iter().zip(values) {
            if *value == Value::Unknown {
                continue;
            }
            message.extend_from_slice(key.as_bytes());
            match value {
                Value::Integer(number) => write!(message, "{number}")?,
                Value::Flag(flag) => write!(message, "{flag}")?,
                Value::Real(number) => serde_json::to_writer(&mut *message, number)?,
                Value::Unknown => {}
            }
        }
        // The first column is always known.
        if let Some(first) = message.first_mut() {
            *first = b'{';
        }
        message.push(b'}');
        self.send(id, stamp)
    }

    fn json(&mut self, id: u16, stamp: &Stamp, message: &impl Serialize) -> Result<()> {
        self.message.clear();
        serde_json::to_writer(&mut self.message, message)?;
        self.send(id, stamp)
    }

    fn send(&mut self, channel_id: u16, stamp: &Stamp) -> Result<()> {
        let time_ns = stamp.microseconds().saturating_mul(1_000);
        let header = MessageHeader { channel_id, sequence: stamp.index, log_time: time_ns, publish_time: time_ns };
        self.file.write_to_known_channel(&header, &self.message).map_err(io_error)
    }
}

impl<W: Write + Seek> Writer for McapWriter<W> {
    fn take(&mut self, entry: &Entry) -> Result<()> {
        match entry {
            Entry::Row { table, stamp, values } => self.row(*table, stamp, values),
            Entry::ToolPose { stamp, pose } => self.json(self.tool_pose, stamp, &PoseInFrame::new(stamp, pose)),
            Entry::Note { stamp, is_warning, text } => {
                let level = if *is_warning { WARNING } else { INFO };
                let log = Log { timestamp: Time::of(stamp), level, message: text, name: "host-cal", file: "", line: 0 };
                self.json(self.notes, stamp, &log)
            }
        }
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        // A metadata record ends the chunk before it: written first, it would leave a chunk without messages, whose time is 1970.
        self.file.write_metadata(&Metadata { name: "ballbar".into(), metadata: self.facts }).map_err(io_error)?;
        self.file.finish().map_err(io_error)?;
        self.file.into_inner().flush()
    }
}

/// `foxglove.PoseInFrame`; metres, as Foxglove draws them.
#[derive(Serialize)]
struct PoseInFrame {
    timestamp: Time,
    frame_id: &'static str,
    pose: PoseOf,
}

#[derive(Serialize)]
struct PoseOf {
    position: Xyz,
    orientation: Quaternion,
}

#[derive(Serialize)]
struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Serialize)]
struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// `foxglove.Log`.
#[derive(Serialize)]
struct Log<'a> {
    timestamp: Time,
    level: u8,
    message: &'a str,
    name: &'static str,
    file: &'static str,
    line: u32,
}

#[derive(Serialize)]
struct Time {
    sec: u64,
    nsec: u64,
}

impl PoseInFrame {
    fn new(stamp: &Stamp, pose: &ToolPose) -> Self {
        let axis = |axis: [f32; 3]| Vector3::from(axis.map(f64::from));
        let (x, y) = (axis(pose.x_axis), axis(pose.y_axis));
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
        // The board's axes are right to single precision: what they lack to unit length is taken out here.
        let q = UnitQuaternion::new_normalize(*UnitQuaternion::from_rotation_matrix(&rotation));
        let [px, py, pz] = pose.position_m.map(f64::from);
        let (position, orientation) = (Xyz { x: px, y: py, z: pz }, Quaternion { x: q.i, y: q.j, z: q.k, w: q.w });
        Self { timestamp: Time::of(stamp), frame_id: BASE_FRAME, pose: PoseOf { position, orientation } }
    }
}

impl Time {
    fn of(stamp: &Stamp) -> Self {
        let us = stamp.microseconds();
        Self { sec: us / 1_000_000, nsec: us % 1_000_000 * 1_000 }
    }
}

/// Adds the channel of a table.
fn table<W: Write + Seek>(file: &mut mcap::Writer<W>, shape: &Shape, table: TableName) -> Result<TableChannel> {
    let (topic, schema) = match table {
        TableName::Samples => ("/samples", "ballbar.Sample"),
        TableName::Settled => ("/settled", "ballbar.Settled"),
        TableName::Bar => ("/bar", "ballbar.Bar"),
    };
    let columns = table.columns(shape);
    let id = channel(file, topic, schema, &table_schema(schema, &columns))?;
    Ok(TableChannel { id, keys: columns.iter().map(|column| format!(",\"{}\":", column.name)).collect() })
}

fn channel<W: Write + Seek>(file: &mut mcap::Writer<W>, topic: &str, name: &str, schema: &Json) -> Result<u16> {
    let schema = file.add_schema(name, "jsonschema", schema.to_string().as_bytes()).map_err(io_error)?;
    file.add_channel(schema, topic, "json", &BTreeMap::new()).map_err(io_error)
}

fn table_schema(title: &str, columns: &[Column]) -> Json {
    let property = |column: &Column| {
        let json_type = match column.column_type {
            ColumnType::Unsigned32 | ColumnType::Signed32 | ColumnType::Signed64 => "integer",
            ColumnType::Flag => "boolean",
            ColumnType::Real { .. } => "number",
        };
        (column.name.clone(), json!({ "type": json_type, "description": format!("unit: {}", column.unit) }))
    };
    let properties: serde_json::Map<String, Json> = columns.iter().map(property).collect();
    let required: Vec<&str> = columns.iter().filter(|column| !column.is_optional).map(|column| column.name.as_str()).collect();
    json!({ "title": title, "type": "object", "properties": properties, "required": required })
}

fn pose_schema() -> Json {
    object(
        "foxglove.PoseInFrame",
        &[
            ("timestamp", time_schema()),
            ("frame_id", json!({ "type": "string" })),
            (
                "pose",
                object(
                    "foxglove.Pose",
                    &[
                        ("position", object("foxglove.Vector3", &["x", "y", "z"].map(number))),
                        ("orientation", object("foxglove.Quaternion", &["x", "y", "z", "w"].map(number))),
                    ],
                ),
            ),
        ],
    )
}

fn log_schema() -> Json {
    let names = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
    let levels: Vec<Json> = names.iter().enumerate().map(|(i, name)| json!({ "title": name, "const": i })).collect();
    object(
        "foxglove.Log",
        &[
            ("timestamp", time_schema()),
            ("level", json!({ "title": "foxglove.LogLevel", "oneOf": levels })),
            ("message", json!({ "type": "string" })),
            ("name", json!({ "type": "string" })),
            ("file", json!({ "type": "string" })),
            ("line", json!({ "type": "integer", "minimum": 0 })),
        ],
    )
}

fn time_schema() -> Json {
    let part = |name| (name, json!({ "type": "integer", "minimum": 0 }));
    object("time", &[part("sec"), part("nsec")])
}

fn number(name: &'static str) -> (&'static str, Json) {
    (name, json!({ "type": "number" }))
}

/// A schema of an object that has all these.
fn object(title: &str, fields: &[(&str, Json)]) -> Json {
    let properties: serde_json::Map<String, Json> =
        fields.iter().map(|(name, schema)| ((*name).to_owned(), schema.clone())).collect();
    let required: Vec<&str> = fields.iter().map(|(name, _)| *name).collect();
    json!({ "title": title, "type": "object", "properties": properties, "required": required })
}

/// The system's own error where there is one inside.
fn io_error(error: McapError) -> Error {
    match error {
        McapError::Io(error) => error,
        other => Error::other(other),
    }
}
