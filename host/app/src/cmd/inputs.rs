//! Arguments that several commands share, and reading what they name.

use std::path::{Path, PathBuf};

use ballbar_calib::model::{Dataset, HeldOut, PairingId, Rig, Robot, RowWarning};
use clap::Args;
use miette::Diagnostic;
use thiserror::Error;

use super::hold_out::HoldOut;
use super::outcome::CommandError;
use super::report::warn;
use crate::files::{Source, open_rig, parse_robot, read_poses, robot_source};
use crate::session::{POSES_NAME, RIG_NAME, ROBOT_NAME};

/// `--json`.
#[derive(Args)]
pub(super) struct OutputArgs {
    /// Print one JSON document instead of text
    #[arg(long)]
    pub(super) json: bool,
}

/// `--force`.
#[derive(Args)]
pub(super) struct ForceArgs {
    /// Write even where a file of another kind stands; never over an input, a recording or a session's file
    #[arg(long)]
    pub(super) force: bool,
}

/// A robot, a rig and files of poses.
#[derive(Args)]
pub(super) struct MeasuredArgs {
    /// robot.toml, or a built-in: puma560, puma560-optimised, irb120, ur5e, stanford, scara; a session's when not given
    #[arg(long)]
    robot: Option<String>,
    /// rig.toml, or the built-in: triangles; a session's when not given
    #[arg(long)]
    rig: Option<String>,
    /// Keep poses apart: bar=610, pairing=A:1 or set=NAME, several separated by commas. `fit` and `rank` take the others, `validate`
    /// takes these, `report` shows how well a fit to the others predicts these
    #[arg(long, value_name = "KEY=VALUE,…")]
    hold_out: Option<HoldOut>,
    /// Files of measured poses (poses.csv), or sessions
    #[arg(required = true, value_name = "SESSION|POSES")]
    poses: Vec<PathBuf>,
}

/// What the arguments named.
pub(super) struct Measured {
    pub(super) robot: Robot,
    /// Its text.
    pub(super) robot_source: Source,
    pub(super) rig: Rig,
    /// The rig's file, or built-in name.
    pub(super) rig_name: String,
    pub(super) dataset: Dataset,
    /// Poses that `--hold-out` keeps apart.
    pub(super) held_out: Option<(HoldOut, Dataset)>,
    /// Rows that may be mistakes, in words.
    pub(super) warnings: Vec<String>,
}

impl Measured {
    /// The poses kept apart, and what to call them.
    pub(super) fn unseen(&self) -> Option<(String, &Dataset)> {
        self.held_out.as_ref().map(|(rule, rows)| (format!("poses held out ({rule})"), rows))
    }
}

impl MeasuredArgs {
    /// Reads the files and says on stderr what may be wrong with them.
    pub(super) fn read(&self) -> Result<Measured, CommandError> {
        let robot_source = robot_source(&self.of_session(self.robot.as_ref(), "--robot", ROBOT_NAME)?)?;
        let robot = parse_robot(&robot_source)?;
        let rig_name = self.of_session(self.rig.as_ref(), "--rig", RIG_NAME)?;
        let rig = open_rig(&rig_name)?;
        let files: Vec<PathBuf> = self.poses.iter().map(|path| poses_of(path)).collect::<Result<_, _>>()?;
        let dataset = read_poses(files.iter().map(PathBuf::as_path), &robot, &rig)?;
        let warnings = summarise(&dataset, &dataset.warnings(&robot, &rig));
        for warning in &warnings {
            warn(warning);
        }
        let (held_out, dataset) = match &self.hold_out {
            None => (None, dataset),
            Some(rule) => {
                let HeldOut { apart, others } = rule.split(dataset, &rig)?;
                (Some((rule.clone(), apart)), others)
            }
        };
        Ok(Measured { robot, robot_source, rig, rig_name, dataset, held_out, warnings })
    }

    /// What was given, or else the file of that name in the sessions; they have to agree.
    fn of_session(&self, given: Option<&String>, flag: &'static str, name: &'static str) -> Result<String, CommandError> {
        if let Some(given) = given {
            return Ok(given.clone());
        }
        let files: Vec<PathBuf> = self.poses.iter().map(|path| path.join(name)).filter(|file| file.is_file()).collect();
        let texts: Vec<Source> = files.iter().map(|file| Source::read_toml(file)).collect::<Result<_, _>>()?;
        match files.split_first() {
            None => Err(ListError::Missing { flag, name }.into()),
            Some(_) if texts.windows(2).any(|pair| pair[0].text() != pair[1].text()) => {
                Err(ListError::SessionsDiffer { flag, name }.into())
            }
            Some((first, _)) => Ok(first.display().to_string()),
        }
    }
}

/// Whether `--max-rms-mm` can be a limit.
pub(super) fn check_max_rms_mm(limit: Option<f64>) -> Result<(), ListError> {
    match limit.filter(|&limit| limit.is_nan() || limit <= 0.0) {
        Some(limit) => Err(ListError::Number { flag: "--max-rms-mm", found: limit.to_string(), expected: "a number above zero" }),
        None => Ok(()),
    }
}

/// The file itself, or a session's.
pub(super) fn poses_of(path: &Path) -> Result<PathBuf, ListError> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    let poses = path.join(POSES_NAME);
    if poses.is_file() { Ok(poses) } else { Err(ListError::NoPosesYet(path.to_owned())) }
}

/// One sentence for each kind of warning, with the first rows that it concerns.
fn summarise(dataset: &Dataset, warnings: &[(usize, RowWarning)]) -> Vec<String> {
    const SHOWN: usize = 5;
    let mut kinds: Vec<(String, Vec<usize>)> = Vec::new();
    for (row, warning) in warnings {
        let text = warning.to_string();
        match kinds.iter_mut().find(|(kind, _)| *kind == text) {
            Some((_, rows)) => rows.push(*row),
            None => kinds.push((text, vec![*row])),
        }
    }
    let sentence = |(text, rows): &(String, Vec<usize>)| {
        let places: Vec<String> = rows.iter().take(SHOWN).map(|&row| dataset.place(row)).collect();
        let more = if rows.len() > SHOWN { format!(" and {} more", rows.len() - SHOWN) } else { String::new() };
        format!("poses that {text}: {} of {}, at {}{more}", rows.len(), dataset.rows.len(), places.join(", "))
    };
    kinds.iter().map(sentence).collect()
}

/// Why a list on the command line cannot be used.
#[derive(Debug, Error, Diagnostic)]
pub(super) enum ListError {
    /// A pairing that is not `chuck:sphere` of this rig.
    #[error("`{0}` is no pairing of this rig, expected chuck:sphere as in A:1,B:2")]
    #[diagnostic(help("The rig has chucks {1} and spheres {2}."))]
    Pairing(String, String, String),
    /// The same pairing twice.
    #[error("pairing `{0}` stands there twice")]
    RepeatedPairing(String),
    /// No pose has one of these pairings.
    #[error("no pose has one of the pairings {0}")]
    #[diagnostic(help("The poses have {1}."))]
    NoPoseLeft(String, String),
    /// Neither given nor in a session.
    #[error("{flag} is missing, and no session among the poses holds a {name}")]
    #[diagnostic(help("Give it: {flag} FILE. Sessions that `host-cal collect` recorded hold theirs."))]
    Missing {
        /// The flag.
        flag: &'static str,
        /// The session's file.
        name: &'static str,
    },
    /// Sessions of different robots or rigs.
    #[error("the sessions hold different files {name}")]
    #[diagnostic(help("Say which one to use: {flag} FILE"))]
    SessionsDiffer {
        /// The flag.
        flag: &'static str,
        /// The session's file.
        name: &'static str,
    },
    /// A directory without poses.
    #[error("{}: holds no poses.csv", .0.display())]
    #[diagnostic(help("Give a file of poses, or a session into which poses were recorded."))]
    NoPosesYet(PathBuf),
    /// No bar length to simulate.
    #[error("the rig names no bar length")]
    #[diagnostic(help("Give one, in millimetres: --bar 460"))]
    NoBar,
    /// No travel to plan for.
    #[error("the rig does not say how far the bar travels")]
    #[diagnostic(help("Add to the rig's file, in millimetres: [bar] with lengths_mm = [460.0] and travel_mm = 75.0"))]
    NoTravel,
    /// A number that is there twice.
    #[error("{flag} has {found} twice")]
    Repeated {
        /// The flag.
        flag: &'static str,
        /// What is there twice.
        found: f64,
    },
    /// A number that has to be above zero, or not below.
    #[error("{flag} is {found}, expected {expected}")]
    Number {
        /// The flag.
        flag: &'static str,
        /// What was given.
        found: String,
        /// What may be given.
        expected: &'static str,
    },
    /// Joint values, more or fewer than joints.
    #[error("{flag} has {found} values, but the robot has {expected} joints")]
    #[diagnostic(help("Give one value a joint, in degrees, or millimetres for a prismatic joint: {flag} 10,20,…"))]
    JointValues {
        /// The flag.
        flag: &'static str,
        /// Values given.
        found: usize,
        /// Joints of the robot.
        expected: usize,
    },
}

/// Reads `A:1,B:2`.
pub(super) fn parse_pairings(text: &str, rig: &Rig) -> Result<Vec<PairingId>, CommandError> {
    let mut pairings = Vec::new();
    for word in text.split(',').map(str::trim) {
        let ends = word.split_once(':').and_then(|(chuck, sphere)| Some((rig.chuck(chuck)?, rig.sphere(sphere)?)));
        let Some((chuck, sphere)) = ends else {
            let names = |points: &[ballbar_calib::model::NamedPoint]| {
                points.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ")
            };
            return Err(ListError::Pairing(word.to_owned(), names(&rig.chucks), names(&rig.spheres)).into());
        };
        let pairing = PairingId { chuck, sphere };
        if pairings.contains(&pairing) {
            return Err(ListError::RepeatedPairing(word.to_owned()).into());
        }
        pairings.push(pairing);
    }
    Ok(pairings)
}
