//! The command as a user runs it: what it takes, prints and refuses.

mod commands;
mod commands_with_a_board;
mod hostile_board;
mod refusals;
mod refused_arguments;
mod screens;
mod shell;
