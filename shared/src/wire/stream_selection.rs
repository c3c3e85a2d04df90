//! What a host asks to be streamed.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// What to stream, any mix.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct StreamSelection {
    /// Every sample.
    pub samples: bool,
    /// A pose whenever the arm has stood still.
    pub settled: bool,
    /// The corrected pose of the tool, at most 1,000 a second.
    pub poses: bool,
}
