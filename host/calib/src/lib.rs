//! Calibration of a robot's kinematics from the lengths of a ball-bar.
//!
//! | module | may know |
//! | --- | --- |
//! | [`units`] | that people read millimetres and degrees |
//! | [`model`] | what a robot, a rig and a measurement are; no algorithm |
//! | [`kinematics`] | where every link of a robot stands, and which joints lead to a pose; no measurement |
//! | [`simulate`] | robots at rigs: the lengths that a true robot would give |
//! | [`identify`] | from measured lengths to parameters: what they can tell, the fit, how sure it is; not whether it is good |
//! | [`assess`] | is a fit good? One answer, with its reasons, from facts alone |
//! | [`plan`] | which poses to measure, and the way between them; neither fits nor judges |
//!
//! SI units and radians everywhere. Nothing here reads or writes a file, and no error knows of a command.
#![forbid(unsafe_code)]

pub mod assess;
pub mod identify;
pub mod kinematics;
pub mod model;
pub mod plan;
pub mod simulate;
pub mod units;
