//! Text that comes from outside: names in files and in a board's hello, paths, the words of parsers and of robot controllers.
//!
//! A terminal obeys control characters, and a reader believes what bidirectional and invisible ones make of a line. So whatever is
//! shown goes through [`visible`] or [`one_line`] on its way out: `cmd` prints nothing past them (`cmd/out.rs`), and neither do the
//! report's page and figures. Files for programs keep their data as they are.

use std::borrow::Cow;
use std::path::Path;

/// Whether a character is obeyed, or not seen, rather than shown: control characters, bidirectional ones, separators of lines and
/// paragraphs, white space other than the space itself, zero-width ones, tags, and what is private or unassigned.
pub fn is_hidden(c: char) -> bool {
    /// Letters and marks that draw nothing: Unicode's Default_Ignorable_Code_Point, as far as the standard library prints them.
    fn draws_nothing(c: char) -> bool {
        matches!(
            c,
            '\u{34f}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}' | '\u{180b}'..='\u{180f}' | '\u{2800}' | '\u{3164}'
        ) || matches!(c, '\u{fe00}'..='\u{fe0f}' | '\u{ffa0}' | '\u{e0100}'..='\u{e01ef}')
    }
    if c.is_ascii() {
        return c.is_ascii_control();
    }
    // Behind a letter, so that accents which stand on it are not escaped.
    let mut on_a_letter = String::from("a");
    on_a_letter.push(c);
    draws_nothing(c) || on_a_letter.escape_debug().nth(1) == Some('\\')
}

/// A text of several lines, with `\u{202e}` and the like for what is hidden. Ends of lines and tabs stay.
pub fn visible(text: &str) -> Cow<'_, str> {
    escaped(text, |c| !matches!(c, '\n' | '\t') && is_hidden(c))
}

/// A text within a line, such as a name: with `\n`, `\t`, `\u{202e}` and the like for what is hidden.
pub fn one_line(text: &str) -> Cow<'_, str> {
    escaped(text, is_hidden)
}

/// A path within a line.
pub fn shown_path(path: &Path) -> String {
    one_line(&path.display().to_string()).into_owned()
}

/// A JSON document of the same meaning, with `\u202e` and the like for what is hidden.
pub fn visible_json(document: &str) -> Cow<'_, str> {
    // Between its strings a document has only ASCII and ends of lines; within them these are escaped already.
    if !document.chars().any(|c| c != '\n' && is_hidden(c)) {
        return document.into();
    }
    let mut text = String::with_capacity(document.len() + 64);
    for c in document.chars() {
        if c != '\n' && is_hidden(c) {
            c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| text += &format!("\\u{unit:04x}"));
        } else {
            text.push(c);
        }
    }
    text.into()
}

fn escaped(text: &str, is_escaped: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.chars().any(&is_escaped) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len() + 64);
    for c in text.chars() {
        if is_escaped(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    shown.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_obeyed_or_not_seen_is_escaped() {
        let hidden = "\0\u{7}\u{1b}\r\u{7f}\u{85}\u{9b}\u{a0}\u{ad}\u{61c}\u{200b}\u{200d}\u{200e}\u{200f}\u{2028}\u{2029}\u{202a}\u{202e}\
                      \u{2060}\u{2066}\u{2069}\u{3000}\u{3164}\u{e000}\u{fe0f}\u{feff}\u{fff9}\u{e0041}\u{e0100}\u{10ffff}";
        for c in hidden.chars() {
            let escape = c.escape_default().to_string();
            assert_eq!(one_line(&c.to_string()), escape);
            assert_eq!(visible(&format!("a{c}b")), format!("a{escape}b"));
        }
        assert_eq!(one_line("two\nlines\tand"), "two\\nlines\\tand");
    }

    #[test]
    fn what_is_read_is_left_as_it_is() {
        for text in ["A:1, 460 mm", "Prüfstand 21 °C ± 0.1 µm", "e\u{301}\u{302}", "плечо", "腕", "ذراع", "🦾", "─●→…", ""]
        {
            assert_eq!(one_line(text), text);
        }
        assert_eq!(visible("two\n\tlines\n"), "two\n\tlines\n");
    }

    #[test]
    fn json_says_the_same() {
        let hostile = "\u{202e}\u{9b}31m\u{7}\u{e0041}\u{2028}\n\"ä\"";
        let document = serde_json::to_string_pretty(&[hostile]).unwrap();
        let shown = visible_json(&document);
        assert!(shown.chars().all(|c| c == '\n' || !is_hidden(c)), "{shown:?}");
        assert_eq!(serde_json::from_str::<Vec<String>>(&shown).unwrap(), [hostile]);
    }
}
