//! Sessions, plans and robots that move: recording and collecting.

mod accounts;
mod approaches;
mod collecting;
mod collecting_a_calibration;
mod collecting_by_controllers;
mod collecting_on_the_way;
mod collecting_with_flaws;
mod recording;
mod refused_collections;
mod robot_links;
mod robot_programs;
mod session_recovery;
