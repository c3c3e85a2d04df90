//! What a log tells, one thing after the other, and who writes it down.

use ballbar::wire::ToolPose;

use super::table::{TableName, Value};

/// When something was.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stamp {
    /// Number of the sample, where it was one.
    pub(super) index: u32,
    /// By the board's clock, microseconds; zero for what the host noted.
    pub(super) t_us: u64,
    /// Microseconds since 1970, UTC; unknown when the mark that tells is damaged.
    pub(super) unix_us: Option<i64>,
    /// The same; where it is unknown, a time that keeps the log's order: the last known one, and what has passed since on the board's
    /// clock.
    pub(super) log_us: i64,
}

impl Stamp {
    /// The time to sort by, microseconds since 1970.
    pub(super) fn microseconds(&self) -> u64 {
        u64::try_from(self.log_us).unwrap_or(0)
    }
}

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
