//! What kind of file something is, by its content: an output replaces files of its own kind, and others only when told to.

use std::fmt;
use std::io::{Read, Result as IoResult};

/// A kind of file that commands write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// `robot.toml`.
    Robot,
    /// `rig.toml`.
    Rig,
    /// `poses.csv` without what only a recording has.
    Poses,
    /// `plan.csv`.
    Plan,
    /// `commands.csv` of `compensate`.
    Commands,
    /// The page of `report`.
    Page,
    /// A figure of `report`.
    Figure,
    /// The numbers of a figure of `report`, or its parameters.
    FigureTable,
    /// URDF as `export` writes it.
    Urdf,
    /// ROS 2 parameters as `export` writes them.
    Ros2,
    /// A Denavit-Hartenberg table as `export` writes it.
    DhTable,
    /// JSON as `export` writes it.
    RobotJson,
    /// YAML as `export` writes it.
    RobotYaml,
    /// Parameters as `export` writes them.
    RobotCsv,
    /// A C header as `export` writes it.
    CHeader,
    /// Rust constants as `export` writes them.
    RustConstants,
    /// An Octave function as `export` writes it.
    OctaveFunction,
    /// Samples of a log as CSV.
    LogCsv,
    /// Samples of a log as Parquet.
    Parquet,
    /// A log as MCAP.
    Mcap,
    /// A manual page.
    ManualPage,
    /// What `demo` printed.
    DemoSummary,
}

impl fmt::Display for FileKind {
    /// With its article: `a robot file`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Robot => "a robot file",
            Self::Rig => "a rig file",
            Self::Poses => "a file of poses",
            Self::Plan => "a plan",
            Self::Commands => "a file of commands",
            Self::Page => "a report",
            Self::Figure => "a report's figure (SVG)",
            Self::FigureTable => "the numbers of a report's figure (CSV)",
            Self::Urdf => "a URDF of `host-cal export`",
            Self::Ros2 => "a ROS 2 parameter file of `host-cal export`",
            Self::DhTable => "a Denavit-Hartenberg table of `host-cal export`",
            Self::RobotJson => "a robot as JSON",
            Self::RobotYaml => "a robot as YAML",
            Self::RobotCsv => "a robot's parameters as CSV",
            Self::CHeader => "a C header of `host-cal export`",
            Self::RustConstants => "Rust constants of `host-cal export`",
            Self::OctaveFunction => "an Octave function of `host-cal export`",
            Self::LogCsv => "a log as CSV",
            Self::Parquet => "a Parquet file",
            Self::Mcap => "an MCAP file",
            Self::ManualPage => "a manual page of `host-cal`",
            Self::DemoSummary => "the summary of `host-cal demo`",
        })
    }
}

/// What a file is found to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    Empty,
    /// A log of a session, which nothing may replace.
    Recording,
    Ours(FileKind),
    /// Anything else, in words.
    Other(&'static str),
}

/// Robots and rigs are read whole, of other kinds the beginning tells.
const MOST_BYTES: u64 = super::reading::MOST_TOML_BYTES;

/// Looks at the beginning of a file.
pub(super) fn recognise(file: impl Read) -> IoResult<Found> {
    let mut bytes = Vec::new();
    file.take(MOST_BYTES).read_to_end(&mut bytes)?;
    Ok(kind_of(&bytes))
}

fn kind_of(bytes: &[u8]) -> Found {
    match bytes {
        [] => return Found::Empty,
        _ if bytes.starts_with(b"BBL1") => return Found::Recording,
        _ if bytes.starts_with(b"PAR1") => return Found::Ours(FileKind::Parquet),
        _ if bytes.starts_with(b"\x89MCAP") => return Found::Ours(FileKind::Mcap),
        _ if bytes.contains(&0) => return Found::Other("a file that is no text"),
        _ => {}
    }
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if text.is_empty() {
        return Found::Empty;
    }
    kind_of_code(text).or_else(|| kind_of_table(text)).or_else(|| kind_of_toml(text)).unwrap_or(Found::Other("another file"))
}

/// Kinds that are known by their first words, or by marks that `host-cal` leaves.
fn kind_of_code(text: &str) -> Option<Found> {
    let is_exported = text.contains("Written by host-cal");
    let ours_or = |kind, is_ours: bool, other| Some(if is_ours { Found::Ours(kind) } else { Found::Other(other) });
    let begins = |word: &str| text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
    if begins("<!doctype html") || begins("<html") {
        return ours_or(FileKind::Page, text.contains("<title>Calibration of "), "a web page of another program");
    }
    if begins("<svg") {
        return ours_or(FileKind::Figure, text.contains("shape-rendering:crispEdges"), "a drawing of another program");
    }
    if begins("<?xml") || begins("<robot") || begins("<!--") {
        return ours_or(FileKind::Urdf, is_exported && text.contains("<robot"), "XML of another program");
    }
    if begins("{") || begins("[\"") || begins("[{") {
        return ours_or(FileKind::RobotJson, text.contains("\"model\": \"tool in base = "), "JSON of another program");
    }
    if begins("name: ") && text.contains("\nmodel: \"tool in base = ") {
        return Some(Found::Ours(FileKind::RobotYaml));
    }
    if begins("function T = robot_pose") {
        return Some(Found::Ours(FileKind::OctaveFunction));
    }
    if begins("A PUMA 560 whose controller believes") {
        return Some(Found::Ours(FileKind::DemoSummary));
    }
    if text.lines().take(8).any(|line| line.starts_with(".TH host-cal")) {
        return Some(Found::Ours(FileKind::ManualPage));
    }
    let of_exports = [("/**:", FileKind::Ros2), ("/*", FileKind::CHeader), ("//", FileKind::RustConstants)];
    of_exports.iter().find(|(mark, _)| is_exported && begins(mark)).map(|&(_, kind)| Found::Ours(kind))
}

/// Kinds of CSV, by their headers.
fn kind_of_table(text: &str) -> Option<Found> {
    let header = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#'))?;
    let columns: Vec<&str> = header.split([',', ';', '\t']).map(|name| name.trim().trim_matches('"')).collect();
    let has = |names: &[&str]| names.iter().all(|name| columns.contains(name));
    if columns.len() < 2 {
        return None;
    }
    let found = if has(&["kind", "chuck", "sphere"]) {
        Found::Ours(FileKind::Plan)
    } else if has(&["chuck", "sphere", "length_mm"]) {
        // What a recording has, and no simulation.
        let is_recorded = ["t_s", "plan_row", "sigma_mm"].iter().any(|name| columns.contains(name));
        if is_recorded { Found::Other("a file of measured poses") } else { Found::Ours(FileKind::Poses) }
    } else if has(&["line", "before_mm", "left_mm"]) {
        Found::Ours(FileKind::Commands)
    } else if has(&["segment", "index", "t_us", "unix_us"]) {
        Found::Ours(FileKind::LogCsv)
    } else if has(&["joint", "type", "theta_deg", "alpha_deg"]) {
        Found::Ours(FileKind::DhTable)
    } else if columns == ["parameter", "unit", "value"] {
        Found::Ours(FileKind::RobotCsv)
    } else if columns[0] == "row" && has(&["residual_after_mm"]) || FIGURE_TABLES.iter().any(|names| columns.starts_with(names)) {
        Found::Ours(FileKind::FigureTable)
    } else {
        Found::Other("a table of another program")
    };
    // Also texts have commas: those are no tables.
    let is_name = |name: &&str| !name.is_empty() && name.len() <= 40 && !name.contains([' ', '=', '[', '{', ':']);
    (columns.iter().all(is_name) || matches!(found, Found::Ours(_))).then_some(found)
}

/// Headers of the report's tables that are not of rows of poses.
const FIGURE_TABLES: [&[&str]; 8] = [
    &["error_before_mm", "error_after_mm", "percent_below"],
    &["from_mm", "to_mm", "lengths", "normal"],
    &["number", "singular_value", "counts"],
    &["step", "rms_mm"],
    &["slice", "x_mm", "y_or_z_mm"],
    &["pairing", "lengths", "mean_mm", "rms_mm"],
    &["parameter", "other", "correlation"],
    &["name", "unit", "initial", "final", "change"],
];

fn kind_of_toml(text: &str) -> Option<Found> {
    let table: toml::Table = text.parse().ok()?;
    let has = |keys: [&str; 2]| keys.iter().all(|key| table.contains_key(*key));
    Some(match () {
        () if has(["links", "joints"]) => Found::Ours(FileKind::Robot),
        () if has(["chucks", "spheres"]) => Found::Ours(FileKind::Rig),
        () if table.contains_key("runs") => Found::Other("the description of a session"),
        () => Found::Other("TOML of another program"),
    })
}
