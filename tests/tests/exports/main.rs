//! What is written for others: robots, logs and documents, read back by other programs.

mod compensating;
mod exporting;
mod exports_read_by_others;
mod json_documents;
mod log_exporting;
