//! The command as a user runs it: what it takes, prints, writes and refuses.

mod accepted_files;
mod chosen_poses;
mod commands;
mod commands_with_a_board;
mod compensating;
mod exporting;
mod exports_read_by_others;
mod hostile_board;
mod hostile_files;
mod hostile_names;
mod inverse_kinematics;
mod json_documents;
mod log_exporting;
mod odd_files;
mod planned_ways;
mod planning;
mod protected_files;
mod refusals;
mod refused_arguments;
mod report_in_a_browser;
mod report_page;
mod screens;
mod shell;
