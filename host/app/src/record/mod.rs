//! Watches what a board streams, and records it: counts, losses, the latest values, the poses that settled; gets over a lost port.
//!
//! ```text
//! board ─▶ BoardLink ─ frames ─▶ Recording ─▶ Account ─▶ Recorder (stream.bbl, poses.csv)
//!                                    │           └─▶ Latest (what is known at this moment)
//!                                    └─▶ News (what a person is told)
//! ```

mod account;
mod latest;
mod news;
mod recording;

pub use account::{Account, Counts, Watched};
pub use latest::{Latest, stillness_name};
pub use news::{Fate, News, Settled, SettledAt};
pub use recording::{Changed, Ended, Recording, RecordingError, StreamSettings};
