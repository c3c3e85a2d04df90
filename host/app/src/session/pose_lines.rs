//! The lines of a session's `poses.csv`: which are poses, whether they are whole, and what identifies them.

use std::path::Path;

use super::pose_file_error::{Damage, PoseFileError};

/// The optional columns that a session's poses have, after the length.
pub(super) const COLUMNS: [&str; 6] = [APPROACH, "t_s", "bar_mm", "plan_row", "rate_mm_s", "lag_ms"];
/// The first of them, which sessions do not have that were begun before it was kept.
pub(super) const APPROACH: &str = "approach";
/// Where some of them stand, counted from the end of a line.
const TIME_FROM_END: usize = 4;
const PLAN_ROW_FROM_END: usize = 2;

/// Whether a text is a file of poses with this header to which lines can be added.
pub(super) fn check(path: &Path, text: &str, header: &str) -> Result<(), PoseFileError> {
    let mut lines = (1..).zip(text.split_inclusive('\n'));
    let (line, found) = lines.by_ref().find(|(_, line)| is_row(line)).unwrap_or((1, ""));
    if found.trim_end() != header {
        let (path, found, expected) = (path.to_owned(), shown(found.trim_end()), header.to_owned());
        return Err(PoseFileError::OtherColumns { path, line, found, expected });
    }
    let damage = |line, damage| Err(PoseFileError::Damaged { path: path.to_owned(), line, damage });
    for (number, line) in lines.filter(|(_, line)| is_row(line)) {
        if let Err(found) = check_row(line.trim_end(), header) {
            return damage(number, found);
        }
    }
    if !text.ends_with('\n') {
        return damage(text.lines().count(), Damage::CutOff);
    }
    Ok(())
}

fn check_row(row: &str, header: &str) -> Result<(), Damage> {
    if row == header {
        return Err(Damage::HeaderAgain);
    }
    let (columns, fields): (Vec<&str>, Vec<&str>) = (header.split(',').collect(), row.split(',').map(str::trim).collect());
    if fields.len() != columns.len() {
        return Err(Damage::FieldCount { found: fields.len(), expected: columns.len() });
    }
    let joints = columns.iter().filter(|column| column.starts_with('q')).count();
    let moving = fields.iter().rev().take(2).any(|field| !field.is_empty());
    for (column, field) in columns.iter().zip(&fields) {
        let number = field.parse::<f64>().ok().filter(|number| number.is_finite() && number.abs() <= MOST);
        let (is_right, expected) = match *column {
            "chuck" | "sphere" => (!field.is_empty(), "a name"),
            "length_mm" | "bar_mm" => (number.is_some_and(|number| number > 0.0), "a number above 0, at most 1e6"),
            "t_s" => (us_of_text(field).is_some(), "a time in seconds"),
            APPROACH => (is_approach(field, joints), "+, - or 0 for each joint, or nothing"),
            "plan_row" => (field.is_empty() || field.parse::<usize>().is_ok(), "a line of plan.csv, or nothing"),
            "rate_mm_s" | "lag_ms" if !moving => (true, ""),
            _ => (number.is_some(), "a number from -1e6 to 1e6"),
        };
        if !is_right {
            return Err(Damage::Field { column: (*column).to_owned(), found: shown(field), expected });
        }
    }
    Ok(())
}

fn is_approach(field: &str, joints: usize) -> bool {
    field.is_empty() || (field.len() == joints && field.bytes().all(|sign| b"+-0".contains(&sign)))
}

/// No length, angle, rate or lag is larger.
const MOST: f64 = 1e6;

/// Whether a line is a pose or the header.
pub(super) fn is_row(line: &str) -> bool {
    !line.trim().is_empty() && !line.starts_with('#')
}

/// A text up to the end of its header, and from there on.
pub(super) fn split_header(text: &str) -> (&str, &str) {
    let before: usize = text.split_inclusive('\n').take_while(|line| !is_row(line)).map(str::len).sum();
    let header = text[before..].find('\n').map_or(text.len() - before, |end| end + 1);
    text.split_at(before + header)
}

/// The header of a text; empty where it has none.
pub(super) fn header(text: &str) -> &str {
    text.lines().find(|line| is_row(line)).unwrap_or_default().trim_end()
}

/// The poses of a text.
pub(super) fn rows(text: &str) -> impl Iterator<Item = &str> {
    split_header(text).1.lines().filter(|line| is_row(line))
}

/// Times of the poses, microseconds, those among them that are commented out.
pub(super) fn times_us<'a>(text: &'a str, header: &'a str) -> impl Iterator<Item = u64> + 'a {
    let uncommented = |line: &'a str| line.trim_start_matches(['#', ' ']).trim_end();
    let is_pose = |row: &&str| check_row(row, header).is_ok();
    split_header(text).1.lines().map(uncommented).filter(is_pose).filter_map(time_us)
}

/// Time of a pose, microseconds.
pub(super) fn time_us(row: &str) -> Option<u64> {
    us_of_text(row.rsplit(',').nth(TIME_FROM_END)?)
}

/// The line of plan.csv that a pose was measured for.
pub(super) fn plan_row(row: &str) -> Option<usize> {
    row.rsplit(',').nth(PLAN_ROW_FROM_END)?.trim().parse().ok()
}

/// Microseconds of a text in seconds.
pub(super) fn us_of_text(text: &str) -> Option<u64> {
    /// Of a board that has been on for 285 years.
    const MOST_S: f64 = 9e9;
    let t_s: f64 = text.trim().parse().ok()?;
    (0.0..=MOST_S).contains(&t_s).then(|| (t_s * 1e6).round() as u64)
}

/// The beginning of a text, with spaces for what a terminal would obey.
fn shown(text: &str) -> String {
    const MOST: usize = 200;
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(MOST).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "chuck,sphere,q1_deg,length_mm,approach,t_s,bar_mm,plan_row,rate_mm_s,lag_ms";
    const ROW: &str = "A,1,1.5,460.25,+,12.000001,460,,,";

    #[test]
    fn every_kind_of_damage_is_found_at_its_line() {
        let good = format!("# a remark\n\n{HEADER}\n{ROW}\n# {ROW}\n\n{ROW}\n");
        let path = Path::new("poses.csv");
        check(path, &good, HEADER).unwrap();
        check(path, &good.replace('\n', "\r\n"), HEADER).unwrap();
        let of_line = |row: &str| good.clone() + row;
        let cases = [
            (of_line("A,1,1.5,460.25,+,12.00"), "poses.csv:8: 6 fields, expected 10"),
            (of_line(ROW), "poses.csv:8: the file ends within"),
            (good.trim_end().to_owned(), "poses.csv:7: the file ends within"),
            (of_line(&format!("{HEADER}\n")), "poses.csv:8: the header stands here again"),
            (of_line("A,1,1.5,460.25,+,12.0,460,,,,\n"), "poses.csv:8: 11 fields"),
            (of_line("A,1,NaN,460.25,+,12.0,460,,,\n"), "poses.csv:8: column `q1_deg`: `NaN`"),
            (of_line("A,1,1e9,460.25,+,12.0,460,,,\n"), "poses.csv:8: column `q1_deg`: `1e9`"),
            (of_line("A,1,,460.25,+,12.0,460,,,\n"), "poses.csv:8: column `q1_deg`: ``"),
            (of_line("A,1,1.5,-3,,12.0,460,,,\n"), "poses.csv:8: column `length_mm`: `-3`"),
            (of_line("A,1,1.5,460.25,,soon,460,,,\n"), "poses.csv:8: column `t_s`: `soon`"),
            (of_line("A,1,1.5,460.25,+,12.0,460,x,,\n"), "poses.csv:8: column `plan_row`: `x`"),
            (of_line("A,1,1.5,460.25,+,12.0,460,,3.5,\n"), "poses.csv:8: column `lag_ms`: ``"),
            (of_line("A,1,1.5,460.25,++,12.0,460,,,\n"), "poses.csv:8: column `approach`: `++`"),
            (of_line("A,1,1.5,460.25,x,12.0,460,,,\n"), "poses.csv:8: column `approach`: `x`"),
            (of_line(",1,1.5,460.25,+,12.0,460,,,\n"), "poses.csv:8: column `chuck`: ``"),
            (of_line("\u{1b}[2J\n"), "poses.csv:8: 1 fields"),
            (of_line("A,1,\u{1b}[2J,460.25,+,12.0,460,,,\n"), "poses.csv:8: column `q1_deg`: ` [2J`"),
            (format!("{HEADER},x\n"), "poses.csv:1: the columns are"),
            (String::new(), "poses.csv:1: the columns are ``"),
            (good.replacen("length_mm", "q1_deg", 1), "poses.csv:3: the columns are"),
        ];
        for (text, message) in cases {
            let error = check(path, &text, HEADER).unwrap_err().to_string();
            assert!(error.starts_with(message) && !error.contains(char::is_control), "{error:?}, expected {message:?}");
        }
    }

    #[test]
    fn a_file_that_is_cut_anywhere_is_found_out_but_at_the_end_of_a_line() {
        let good = format!("{HEADER}\n{ROW}\n{ROW}\n");
        for cut in 0..good.len() {
            let is_whole = good[..cut].ends_with('\n');
            assert_eq!(check(Path::new("poses.csv"), &good[..cut], HEADER).is_ok(), is_whole, "{cut} bytes: {}", &good[..cut]);
        }
    }
}
