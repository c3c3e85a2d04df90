//! From the bytes of a file to its text.

use encoding_rs::{Encoding, UTF_8};

use super::problem::{Problem, short};
use super::source::{InputError, Source};

/// The text in the encoding that the byte order mark says, or else in the one declared, or else in UTF-8. Nothing is guessed: a wrong
/// letter in a name would be another name.
pub(super) fn decode(name: &str, bytes: &[u8], declared: Option<&'static Encoding>) -> Result<Source, InputError> {
    let (encoding, mark) = Encoding::for_bom(bytes).unwrap_or((declared.unwrap_or(UTF_8), 0));
    let (text, is_damaged) = encoding.decode_without_bom_handling(&bytes[mark..]);
    let source = Source::new(name, &text);
    // First, since UTF-16 without its mark is full of them.
    if let Some(at) = source.text().find('\0') {
        return Err(InputError::at(&source, at..at + 1, Problem::ZeroByte));
    }
    if is_damaged {
        let at = source.text().find(char::REPLACEMENT_CHARACTER).unwrap_or(0);
        let problem = Problem::NotText { encoding: encoding.name() };
        return Err(InputError::at(&source, at..at + char::REPLACEMENT_CHARACTER.len_utf8(), problem));
    }
    Ok(source)
}

/// The encoding that the first line of an XML document says.
pub(super) fn declared(name: &str, bytes: &[u8]) -> Result<Option<&'static Encoding>, InputError> {
    /// More than any declaration has.
    const MOST: usize = 200;
    let head = &bytes[..bytes.len().min(MOST)];
    let Some(declaration) = head.strip_prefix(b"<?xml") else { return Ok(None) };
    let text = String::from_utf8_lossy(declaration);
    let text = text.split("?>").next().unwrap_or_default();
    let Some((_, value)) = text.split_once("encoding") else { return Ok(None) };
    let label = value.trim_start_matches(|c: char| c == '=' || c.is_ascii_whitespace());
    let label = label.trim_start_matches(['"', '\'']).split(['"', '\'']).next().unwrap_or_default();
    match Encoding::for_label(label.as_bytes()) {
        // What says UTF-16 in letters of one byte has been converted since.
        Some(encoding) => Ok(Some(encoding.output_encoding())),
        None => {
            const SHOWN: usize = 40;
            let source = Source::new(name, &String::from_utf8_lossy(bytes));
            Err(InputError::at(&source, 0..text.len() + "<?xml".len(), Problem::Encoding(short(label, SHOWN))))
        }
    }
}
