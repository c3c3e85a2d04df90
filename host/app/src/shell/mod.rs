//! What a shell and `man` are told of a command, made from its arguments and its help.

mod completions;
mod manual;

pub use completions::completion_script;
pub use manual::{ManualPage, manual_page, manual_pages};
