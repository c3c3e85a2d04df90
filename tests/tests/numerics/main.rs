//! Numbers: golden values, derivatives, ranks, precision, real data.

mod assessments;
mod built_in_robots;
mod canonical_frames;
mod causes;
mod designs;
mod fits_in_other_frames;
mod golden;
mod gradients;
mod identification;
mod joint_terms;
mod noise;
mod normal_equations;
mod precision;
mod priors;
mod ranks;
mod real_data;
mod report_proofs;
mod robots;
mod scores;
mod stored;
mod unknowns;
mod wrong_data;
mod wrong_rows;
