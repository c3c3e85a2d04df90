//! The terminal, or what stands in its place: what is printed and said, tables, progress, the steady screen, what is typed, and the wish
//! to end. The only way to stdout and stderr.

mod end_request;
mod given_back;
pub(crate) mod out;
mod progress;
pub(crate) mod screen;
pub(crate) mod table;
mod typed;

pub(crate) use end_request::{EndRequest, INTERRUPTED};
pub use out::show_error;
pub(crate) use progress::progress;
pub(crate) use typed::typed_lines;
