//! Numbers: golden values, derivatives, ranks, precision, real data.

mod assessments;
mod built_in_robots;
mod designs;
mod golden;
mod gradients;
mod identification;
mod joint_terms;
mod normal_equations;
mod precision;
mod ranks;
mod real_data;
mod report_proofs;
mod robots;
mod stored;
