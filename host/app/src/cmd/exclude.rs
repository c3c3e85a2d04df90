//! `--exclude`: rows left out by hand.

use std::str::FromStr;

use ballbar_calib::model::Dataset;
use miette::Diagnostic;
use thiserror::Error;

/// Numbers of rows, from 1 over all files, in ranges with both ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Exclude {
    ranges: Vec<(usize, usize)>,
}

#[derive(Debug, PartialEq, Eq, Error, Diagnostic)]
pub(super) enum ExcludeError {
    #[error("--exclude: there is no row {found}, expected 1 to {rows}")]
    #[diagnostic(help("Rows are counted over all files, without their heads; `fit` names a row with its number and its line."))]
    NoSuchRow { found: usize, rows: usize },
    #[error("--exclude: every row is excluded")]
    #[diagnostic(help("Leave some to be fitted."))]
    Everything,
}

impl FromStr for Exclude {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let range = |word: &str| {
            let (first, last) = word.split_once('-').unwrap_or((word, word));
            let number = |text: &str| text.trim().parse::<usize>().ok().filter(|&number| number > 0);
            let range = number(first).zip(number(last)).filter(|(first, last)| first <= last);
            range.ok_or_else(|| "expected numbers of rows and ranges of them, separated by commas: 12,40-45".to_owned())
        };
        Ok(Self { ranges: text.split(',').map(range).collect::<Result<_, _>>()? })
    }
}

impl Exclude {
    /// The other rows.
    pub(super) fn others(&self, dataset: Dataset) -> Result<Dataset, ExcludeError> {
        let rows = dataset.rows.len();
        let last = self.ranges.iter().map(|(_, last)| *last).max().unwrap_or_default();
        if last > rows {
            return Err(ExcludeError::NoSuchRow { found: last, rows });
        }
        let (_, others) = dataset.split(|row| self.ranges.iter().any(|(first, last)| (*first..=*last).contains(&row.number)));
        if others.rows.is_empty() { Err(ExcludeError::Everything) } else { Ok(others) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_numbers_and_ranges() {
        assert_eq!("12, 40-45".parse(), Ok(Exclude { ranges: vec![(12, 12), (40, 45)] }));
        for wrong in ["", "0", "3-1", "a", "1-", "-2", "1..3"] {
            assert!(wrong.parse::<Exclude>().is_err(), "{wrong}");
        }
    }
}
