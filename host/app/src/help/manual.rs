//! Manual pages, made from the same arguments and help as everything else.

use clap::Command;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};

/// Names and texts of the pages of a command and of all that it has.
pub fn all_pages(command: &Command) -> Vec<(String, String)> {
    let shown = command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set());
    std::iter::once(page(command)).chain(shown.flat_map(all_pages)).collect()
}

/// Name and text of a command's page.
pub fn page(command: &Command) -> (String, String) {
    let man = Man::new(command.clone())
        .source(concat!("host-cal ", env!("CARGO_PKG_VERSION")))
        .manual("Robot calibration with a ball-bar");
    let mut text = Vec::new();
    // Written to memory, which never fails.
    let written = man
        .render_title(&mut text)
        .and_then(|()| man.render_name_section(&mut text))
        .and_then(|()| man.render_synopsis_section(&mut text))
        .and_then(|()| man.render_description_section(&mut text))
        .and_then(|()| if has_options(command) { man.render_options_section(&mut text) } else { Ok(()) })
        .and_then(|()| if has_commands(command) { man.render_subcommands_section(&mut text) } else { Ok(()) })
        .and_then(|()| after_help(command).to_writer(&mut text));
    debug_assert!(written.is_ok(), "memory takes everything");
    (man.get_filename(), in_ascii(&String::from_utf8_lossy(&text)))
}

/// With every other character by its name in roff, since not every formatter takes UTF-8.
fn in_ascii(text: &str) -> String {
    let mut ascii = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_ascii() {
            ascii.push(character);
        } else {
            ascii += &format!("\\[u{:04X}]", u32::from(character));
        }
    }
    ascii
}

fn has_options(command: &Command) -> bool {
    command.get_arguments().any(|arg| !arg.is_hide_set())
}

fn has_commands(command: &Command) -> bool {
    command.get_subcommands().any(|subcommand| !subcommand.is_hide_set())
}

/// What stands below the options in the help: examples line by line, the rest as text.
fn after_help(command: &Command) -> Roff {
    let mut roff = Roff::default();
    let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    for paragraph in text.split("\n\n").filter(|paragraph| !paragraph.trim().is_empty()) {
        if let Some((_, examples)) = paragraph.split_once('\n').filter(|(title, _)| title.starts_with("Example")) {
            roff.control("SH", ["EXAMPLES"]);
            roff.control("nf", []);
            roff.text(examples.lines().map(|line| roman(format!("{}\n", line.trim_start()))).collect::<Vec<_>>());
            roff.control("fi", []);
        } else {
            roff.control("SH", ["NOTES"]);
            roff.text([roman(paragraph)]);
        }
    }
    roff
}
