//! What can be wrong with an input file, and what to do about it.

use ballbar::TermsError;
use thiserror::Error;

use crate::text::one_line;

/// What is wrong. Each variant knows what was found and what was expected.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// Bytes that are no text.
    #[error("this is no {encoding} text")]
    NotText {
        /// The encoding that was expected.
        encoding: &'static str,
    },
    /// A text with a byte that no text has.
    #[error("a zero byte, which no text has")]
    ZeroByte,
    /// An XML document in an encoding that nobody knows.
    #[error("unknown encoding `{0}`")]
    Encoding(String),
    /// More of something than any file has.
    #[error("{found} {what}, expected at most {most}")]
    TooMany {
        /// `chucks`, `spheres`, `bar lengths`.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// Neither a file nor a built-in has this name.
    #[error("no such file, and no built-in {what} of this name")]
    NoSuchFile {
        /// `robot` or `rig`.
        what: &'static str,
        /// The names that are built in.
        builtins: String,
    },
    /// Not TOML, an unknown or missing key, or a value of the wrong type; in the parser's words.
    #[error("{0}")]
    Toml(String),
    /// A robot's name that is no line of a screen.
    #[error("`name` is `{found}`, {bytes} bytes long, expected at most 200 bytes without control characters")]
    RobotName {
        /// The name, as far as a message can show it.
        found: String,
        /// Its length.
        bytes: usize,
    },
    /// A robot needs 1 to 8 joints.
    #[error("{found} joints, expected 1 to 8")]
    JointCount {
        /// Joints in the file.
        found: usize,
    },
    /// J joints need J + 1 links.
    #[error("{found} links, expected {expected}: one more than the {joints} joints")]
    LinkCount {
        /// Links in the file.
        found: usize,
        /// Links that the joints need.
        expected: usize,
        /// Joints in the file.
        joints: usize,
    },
    /// A key whose unit belongs to the other kind of joint.
    #[error("`{key}` on a {kind} joint, expected `{expected}`")]
    JointUnit {
        /// The key found.
        key: &'static str,
        /// `revolute` or `prismatic`.
        kind: &'static str,
        /// The key with the fitting unit.
        expected: String,
    },
    /// A joint without one of its keys.
    #[error("joint {joint} has no `{key}`")]
    JointKeyMissing {
        /// Number of the joint, from 1.
        joint: usize,
        /// The key that it needs.
        key: String,
    },
    /// A vector that has not three numbers.
    #[error("`{field}` has {found} numbers, expected 3")]
    VectorLength {
        /// The key.
        field: &'static str,
        /// How many stand there.
        found: usize,
    },
    /// A number that is infinite, not a number, or out of its range.
    #[error("`{field}` is {found}, expected {expected}")]
    Number {
        /// Key or column.
        field: String,
        /// What stands there.
        found: String,
        /// What may stand there.
        expected: &'static str,
    },
    /// A tolerance that none can be.
    #[error("`{field}` is {found}, expected {expected}")]
    Tolerance {
        /// The key.
        field: &'static str,
        /// What stands there.
        found: String,
        /// What may stand there.
        expected: &'static str,
    },
    /// A list of tolerances that is not that of the bar's lengths.
    #[error("`zero_tolerance_mm` has {found} numbers, expected {lengths}, one for each of `lengths_mm`")]
    RodTolerances {
        /// How many stand there.
        found: usize,
        /// Lengths of the bar.
        lengths: usize,
    },
    /// The lower limit is not below the upper one.
    #[error("joint {joint}: the lower limit {min} is not below the upper limit {max}")]
    Limits {
        /// Number of the joint, from 1.
        joint: usize,
        /// Lower limit as in the file.
        min: f64,
        /// Upper limit as in the file.
        max: f64,
    },
    /// Terms of joints, or masses, that no robot has.
    #[error("{0}")]
    Terms(TermsError),
    /// A list of something else than a joint's four coefficients.
    #[error("`eccentricity_deg` has {found} numbers, expected 4")]
    Eccentricity {
        /// How many stand there.
        found: usize,
    },
    /// A mass that is nowhere, or a centre of nothing.
    #[error("`{found}` without `{missing}`")]
    HalfABody {
        /// The key that is there.
        found: &'static str,
        /// The key that is not.
        missing: &'static str,
    },
    /// No sign, or not one for each joint.
    #[error("column `approach`: `{found}`, expected one of +, - and 0 for each of {joints} joints")]
    Approach {
        /// What stands there.
        found: String,
        /// Joints of the robot.
        joints: usize,
    },
    /// A direction of gravity that is none.
    #[error("`gravity` has no direction")]
    NoGravity,
    /// Coupling to a joint that is not nearer to the base, or twice to the same.
    #[error("joint {joint} is coupled to joint {to}, expected a joint nearer to the base, and each once")]
    Coupling {
        /// Number of the joint, from 1.
        joint: usize,
        /// The joint it is coupled to.
        to: usize,
    },
    /// No chuck or no sphere in a rig.
    #[error("no {0}, expected at least one")]
    Empty(&'static str),
    /// A bar without a length.
    #[error("no bar length, expected at least one")]
    NoBarLength,
    /// Two chucks, spheres, columns of one name.
    #[error("{what} `{name}` stands there twice")]
    Duplicate {
        /// `chuck`, `sphere` or `column`.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A chuck's or sphere's name that a pairing `A:1,B:2` or a CSV field cannot hold.
    #[error("the name {0:?} is empty or holds a comma, colon, quote, `#`, control character or white space at its ends")]
    Name(String),
    /// The poses' header lacks a column.
    #[error("the column `{name}` is missing")]
    MissingColumn {
        /// The column.
        name: String,
        /// What a header has.
        expected: &'static str,
    },
    /// The poses' header has a column that no robot file asks for.
    #[error("unknown column `{name}`")]
    UnknownColumn {
        /// The column.
        name: String,
        /// What a header has.
        expected: &'static str,
    },
    /// A joint's column has the unit of the other kind of joint.
    #[error("column `{found}`, but joint {joint} is {kind}: expected `{expected}`")]
    ColumnUnit {
        /// The column found.
        found: String,
        /// The column with the fitting unit.
        expected: String,
        /// Number of the joint, from 1.
        joint: usize,
        /// `revolute` or `prismatic`.
        kind: &'static str,
    },
    /// The header has more or fewer joint columns than the robot has joints.
    #[error("{found} joint columns, but the robot has {expected} joints")]
    JointColumns {
        /// Joint columns in the header.
        found: usize,
        /// Joints of the robot.
        expected: usize,
        /// What a header has.
        header: &'static str,
    },
    /// A row with more or fewer fields than the header.
    #[error("{found} fields, expected {expected} as in the header")]
    FieldCount {
        /// Fields in the row.
        found: usize,
        /// Fields in the header.
        expected: usize,
    },
    /// A field that is no number at all.
    #[error("column `{column}`: `{found}` is not a number")]
    NotANumber {
        /// The column.
        column: String,
        /// What stands there.
        found: String,
    },
    /// A chuck or sphere that the rig does not have.
    #[error("unknown {what} `{found}`, the rig has {known}")]
    UnknownEnd {
        /// `chuck` or `sphere`.
        what: &'static str,
        /// What stands there.
        found: String,
        /// The rig's names.
        known: String,
    },
    /// A field with nothing in it.
    #[error("column `{column}`: the field is empty")]
    EmptyField {
        /// The column.
        column: String,
    },
    /// A quote that goes on over the end of its line.
    #[error("a quote that is opened on this line is not closed on it")]
    OpenQuote,
    /// A header and nothing else.
    #[error("no {0}")]
    NoRows(&'static str),
    /// CSV that cannot be split into records.
    #[error("not CSV: {0}")]
    Csv(String),
    /// `sigma_mm` in one file of poses and not in another.
    #[error("`sigma_mm` is given here and not in the files before, or the other way round")]
    MixedSigma,
    /// A field that has to be one of some words.
    #[error("column `{column}` is `{found}`, expected {expected}")]
    Word {
        /// The column.
        column: &'static str,
        /// What stands there.
        found: String,
        /// The words.
        expected: &'static str,
    },
    /// A file that is longer than any of its kind.
    #[error("longer than {most_bytes} bytes")]
    TooLong {
        /// What is read at most.
        most_bytes: u64,
    },
    /// Not XML, or XML with a document type, in the parser's words.
    #[error("not XML that can be read: {0}")]
    Xml(String),
    /// A robot description that is yet to be expanded.
    #[error("this is xacro, a program that makes a URDF, and no URDF yet")]
    Xacro,
    /// An element or attribute of a robot description that is missing or cannot be what it is.
    #[error("{what} is {found}, expected {expected}")]
    Urdf {
        /// The element or attribute, and of which joint.
        what: String,
        /// What stands there.
        found: String,
        /// What may stand there.
        expected: &'static str,
    },
    /// Links and joints that are no tree.
    #[error("{0}")]
    UrdfTree(String),
    /// A link that was asked for and is not there.
    #[error("{what} `{found}` is no link of this robot")]
    UrdfLink {
        /// Which end was asked for: `--base` or `--tip`.
        what: &'static str,
        /// The name asked for.
        found: String,
        /// The names to choose from.
        known: String,
    },
    /// A tree with several ends, any of which may be the tool.
    #[error("the tree has several ends, and nothing says which one is the tool")]
    UrdfEnds {
        /// The names to choose from.
        known: String,
    },
    /// A plan's length is not that of this robot at this rig.
    #[error("the plan expects a length of {planned_mm:.3} mm, but this robot at this rig has {length_mm:.3} mm here")]
    PlanOfAnother {
        /// The length in the plan, millimetres.
        planned_mm: f64,
        /// The length by the robot and rig given, millimetres.
        length_mm: f64,
    },
}

impl Problem {
    /// What to do about it.
    pub(super) fn help(&self) -> Option<String> {
        let help = match self {
            Self::NoSuchFile { what, builtins } => return Some(format!("Give a path, or a built-in {what}: {builtins}.")),
            Self::Unreadable(_) | Self::Csv(_) | Self::Number { .. } | Self::VectorLength { .. } | Self::EmptyField { .. } => {
                return None;
            }
            Self::NotText { encoding: "UTF-8" } => {
                "Save it as UTF-8: in a spreadsheet \"CSV UTF-8\", in an editor \"Save with encoding\". Or: iconv -f WINDOWS-1252 -t UTF-8"
            }
            Self::NotText { .. } => "The file is damaged, or in another encoding than it says. Save it as UTF-8.",
            Self::ZeroByte => "Is it UTF-16 without a byte order mark, or no text at all? Save it as UTF-8.",
            Self::Encoding(_) => "Save it as UTF-8, and say encoding=\"UTF-8\" in the first line.",
            Self::TooMany { .. } => "Rigs have far fewer; is it the right file?",
            Self::FieldCount { .. } => "Is there a decimal comma? Write numbers with a point, or part the fields by semicolons.",
            Self::OpenQuote => "Close the quote, or write the field without quotes.",
            Self::NoBarLength => "lengths_mm holds the bar's length at mid travel, one for each extension.",
            Self::JointColumns { found: 0, header, .. } => {
                return Some(format!("The first line must be the header, parted by commas, semicolons or tabs: {header}."));
            }
            Self::RobotName { .. } => "Screens and files of others show the name: write a short one, on one line.",
            Self::Toml(_) => "The keys and their units are in docs/files.md.",
            Self::JointCount { .. } | Self::LinkCount { .. } => "A chain is link 1, joint 1, link 2, … joint J, link J+1.",
            Self::JointUnit { .. } | Self::ColumnUnit { .. } => "Angles are in degrees (`_deg`), slides in millimetres (`_mm`).",
            Self::JointKeyMissing { .. } => "A joint needs type, offset, scale and both limits.",
            Self::Tolerance { .. } => {
                "It is a standard deviation: 0 where the value is known exactly. Leave the key out where nobody says how well it is known."
            }
            Self::RodTolerances { .. } => {
                "Where all are known alike, one number without brackets will do: zero_tolerance_mm = 0.2"
            }
            Self::NotANumber { .. } => "Write a plain decimal number with a point.",
            Self::Limits { .. } => "Limits are those of the encoder output q.",
            Self::Terms(TermsError::NoLoad { .. }) => {
                "Gravity does it: give mass_kg and center_mm of the links behind the joint, or payload = { mass_kg = …, center_mm = […] }."
            }
            Self::Terms(TermsError::EccentricSlide { .. }) => {
                "Eccentricity is that of an encoder's disc, which turns with the joint."
            }
            Self::Terms(_) | Self::HalfABody { .. } => {
                "The keys of joint terms and masses, and their units, are in docs/files.md."
            }
            Self::Eccentricity { .. } => "They are the coefficients of sin q, cos q, sin 2q and cos 2q.",
            Self::Approach { .. } => {
                "+ where the joint's value rose on the way there, - where it fell, 0 where that is not known: +-00+-"
            }
            Self::NoGravity => {
                "It is the direction in which things fall, in the base frame: gravity = [0, 0, -1] of a robot that stands upright."
            }
            Self::Coupling { .. } => {
                "`coupling = { joint = 5, ratio = 0.18 }` on joint 6: it turns by 0.18 of joint 5's turn. Several are a list: [{ … }, { … }]."
            }
            Self::Empty(_) => "A rig needs chucks and spheres.",
            Self::Duplicate { .. } => "Give each a name of its own.",
            Self::Name(_) => "Poses and pairings (A:1,B:2) refer to chucks and spheres by these names.",
            Self::MissingColumn { expected, .. }
            | Self::UnknownColumn { expected, .. }
            | Self::JointColumns { header: expected, .. } => return Some(format!("Expected: {expected}.")),
            Self::UnknownEnd { .. } => "Names are compared letter by letter; is this the rig that was measured with?",
            Self::NoRows("targets") => "Write a target a line below the header.",
            Self::NoRows(_) => "Was the recording stopped before the first pose settled?",
            Self::Word { .. } => return None,
            Self::TooLong { .. } => "Files of its kind are far shorter; is it the right file?",
            Self::Xml(_) => {
                "A URDF file is needed, without DOCTYPE and entities; expand a xacro file first: xacro robot.xacro > robot.urdf"
            }
            Self::Xacro => "Expand it first: xacro robot.xacro > robot.urdf",
            Self::Urdf { .. } => "See the URDF specification: a joint has a parent, a child, origin, axis and limit.",
            Self::UrdfTree(_) => {
                "The links and joints of a URDF are a tree: one root, and one joint above every other link. `--base` is nearer to the root."
            }
            Self::UrdfLink { known, .. } => return Some(format!("Links: {known}.")),
            Self::UrdfEnds { known } => return Some(format!("Name it: --tip LINK. Ends: {known}.")),
            Self::PlanOfAnother { .. } => {
                "Was it planned for another robot, or has the robot's or the rig's file changed since? Plan again."
            }
            Self::MixedSigma => "Weights compare poses with one another: give `sigma_mm` for every pose, or for none.",
        };
        Some(help.to_owned())
    }
}

/// At most so many characters of a text, on one line.
pub(super) fn short(text: &str, most: usize) -> String {
    let text = one_line(text);
    let mut shown: String = text.chars().take(most).collect();
    if text.chars().nth(most).is_some() {
        shown.push('…');
    }
    shown
}
