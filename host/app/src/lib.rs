//! Calibration of a robot's kinematics from ball-bar lengths: what the `host-cal` command is made of. The computing itself is
//! [`ballbar_calib`].
//!
//! | module | holds |
//! | --- | --- |
//! | [`board`] | the host's end of the wire: port, requests, losses |
//! | [`robot_link`] | robot controllers: how a robot is moved, whoever made it |
//! | [`collect`] | walks a plan: moves the robot, waits, measures, keeps |
//! | `operator` | who stands at the robot while a plan is walked: what is asked, and what is typed |
//! | [`session`] | a recording: its log, its poses, what it was recorded with |
//! | [`record`] | watches what a board streams, and keeps it; gets over a lost port |
//! | [`files`] | robots, rigs and measured poses: reading with located errors, writing by rename |
//! | [`export`] | a robot in the formats of others, one file each |
//! | [`virtual_board`] | the firmware with a simulated robot and bar, behind a port |
//! | [`paper`] | the paper's experiment, and its numbers |
//! | [`documents`] | what commands print as JSON, as types |
//! | [`report`] | a calibration as a page for people: facts, figures, HTML |
//! | [`remedies`] | what to do about the errors of the calibration library and of the procedures |
//! | [`shell`] | manual pages, and what completes arguments |
//! | [`deadline`] | how long a whole answer may take |
//! | `platform` | what differs between operating systems |
//! | [`terminal`] | what is printed, said, shown and typed |
//! | [`text`] | what comes from outside, as a terminal may show it |
//! | [`cmd`] | one file a subcommand: its arguments, what it runs, what it prints |
//!
//! SI units inside; millimetres and degrees in files and on screens, converted at the edge (see [`units`]).
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests look at files from outside"))]

pub mod board;
pub mod cmd;
pub mod collect;
pub mod deadline;
pub mod documents;
pub mod export;
pub mod files;
mod operator;
pub mod paper;
mod platform;
pub mod record;
pub mod remedies;
pub mod report;
pub mod robot_link;
#[expect(clippy::disallowed_methods, reason = "a session appends to its log, and reads its own files before it replaces them")]
pub mod session;
pub mod shell;
pub mod terminal;
pub mod text;
pub mod units;
#[cfg(unix)]
pub mod virtual_board;
