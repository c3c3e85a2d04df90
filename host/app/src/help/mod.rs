//! What a shell and `man` need to know of a command, made from its arguments and its help.

mod completions;
mod manual;

pub use completions::completion_script;
pub use manual::{all_pages, page};
