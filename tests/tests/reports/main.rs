//! The page of a calibration, by itself and in a browser.

mod report_in_a_browser;
mod report_page;
