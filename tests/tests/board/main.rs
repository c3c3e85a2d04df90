//! The board's portable firmware, its frames and its wire, on this machine.

mod board;
mod board_commands;
mod board_self_test;
mod board_streams;
mod encoders;
mod flash_of_before;
mod framing;
mod fuzz;
mod joint_terms;
mod message_filter;
mod plausible_parameters;
mod procedures;
mod settling;
mod slots;
mod virtual_board;
mod wire_document;
mod wire_sizes;
