//! Text and numbers as every language takes them.

use crate::units::fixed;

/// The text's printable ASCII without what ends a comment or a text in one of the languages, at most `width` characters.
pub(super) fn printable(text: &str, width: usize) -> String {
    let kept = |c: char| c.is_ascii_alphanumeric() || " .,:+-=()/#_".contains(c);
    let text: String = text.chars().map(|c| if kept(c) { c } else { ' ' }).collect();
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    // ASCII, so that characters are bytes.
    text[..text.len().min(width)].trim_end().to_owned()
}

/// A text in printable lines of at most `width` characters, broken between words where that is possible.
pub(super) fn lines(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in printable(text, usize::MAX).split(' ') {
        // ASCII, so that characters are bytes.
        for part in word.as_bytes().chunks(width).map(String::from_utf8_lossy) {
            match lines.last_mut() {
                Some(line) if line.len() + 1 + part.len() <= width => *line += &format!(" {part}"),
                _ => lines.push(part.into_owned()),
            }
        }
    }
    lines
}

/// What stands behind a variable from which a number is taken: `-12.345`, or `+12.345` for a number below zero.
pub(super) fn minus(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    match text.strip_prefix('-') {
        Some(digits) => format!("+{digits}"),
        None => format!("-{text}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_keep_every_word() {
        assert_eq!(lines("the bar OFF; \"drive\"\n carefully", 11), ["the bar OFF", "drive", "carefully"]);
        assert_eq!(lines("a_word_that_is_too_long", 10), ["a_word_tha", "t_is_too_l", "ong"]);
        assert_eq!(lines("", 10), [""; 0]);
    }

    #[test]
    fn a_number_is_taken_away_by_one_sign() {
        assert_eq!([minus(12.5, 2), minus(-12.5, 2), minus(-0.001, 2)], ["-12.50", "+12.50", "-0.00"]);
    }
}
