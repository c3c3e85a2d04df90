//! What a log tells, one thing after the other, and who writes it down.

use ballbar::wire::ToolPose;

use super::stamp::Stamp;
use super::table::{TableName, Value};

/// One thing that a log tells.
pub(super) enum Entry<'a> {
    /// A row of a table.
    Row { table: TableName, stamp: Stamp, values: &'a [Value] },
    /// The tool in the base frame, by the board's own parameters.
    ToolPose { stamp: Stamp, pose: &'a ToolPose },
    /// Something that happened to the recording.
    Note { stamp: Stamp, is_warning: bool, text: String },
}

/// A file being written. What it has no place for it leaves out.
pub(super) trait Writer {
    /// Writes an entry.
    fn take(&mut self, entry: &Entry) -> std::io::Result<()>;

    /// Writes what is left to write.
    fn finish(self: Box<Self>) -> std::io::Result<()>;
}
