//! Files as they come: those that are taken, odd ones, hostile ones, and those that may not be overwritten.

mod accepted_files;
mod hostile_files;
mod hostile_names;
mod odd_files;
mod protected_files;
mod robot_terms;
mod tolerances;
