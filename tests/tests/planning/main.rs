//! Plans: what they keep away from, which poses they choose, and what `host-cal plan` says of them.

mod chosen_poses;
mod inverse_kinematics;
mod planned_ways;
mod planning;
mod rewritten_frames;
