//! When something that a log tells was.

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
