//! Measured poses, and the robot and the rig that they are of: files, or sessions that hold all three.

use std::path::{Path, PathBuf};

use ballbar_calib::model::{Dataset, Rig, Robot};
use thiserror::Error;

use super::POSES_NAME;
use super::inputs::SessionFile;
use crate::files::{InputError, Source, open_rig, parse_robot, read_poses, robot_source};

/// What is to be read.
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    /// The robot's file, or a built-in; the sessions' when not given.
    pub robot: Option<&'a str>,
    /// The rig's file, or a built-in; the sessions' when not given.
    pub rig: Option<&'a str>,
    /// Files of poses, and sessions.
    pub poses: &'a [PathBuf],
}

/// What was read.
#[derive(Debug)]
pub struct MeasuredInputs {
    /// The robot.
    pub robot: Robot,
    /// Its text.
    pub robot_source: Source,
    /// The rig.
    pub rig: Rig,
    /// The rig's file, or built-in name.
    pub rig_name: String,
    /// All poses.
    pub dataset: Dataset,
}

/// Why measured poses cannot be used.
#[derive(Debug, Error)]
pub enum MeasuredError {
    /// A file cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Neither given nor in a session.
    #[error("no session holds a {}", .0.name())]
    Missing(SessionFile),
    /// Sessions of different robots or rigs.
    #[error("the sessions hold different files {}", .0.name())]
    SessionsDiffer(SessionFile),
    /// A directory without poses.
    #[error("{}: holds no {POSES_NAME}", .0.display())]
    NoPosesYet(PathBuf),
}

impl Named<'_> {
    /// Reads all of it.
    ///
    /// # Errors
    /// [`MeasuredError`].
    pub fn read(&self) -> Result<MeasuredInputs, MeasuredError> {
        let robot_source = robot_source(&self.of_sessions(self.robot, SessionFile::Robot)?)?;
        let robot = parse_robot(&robot_source)?;
        let rig_name = self.of_sessions(self.rig, SessionFile::Rig)?;
        let rig = open_rig(&rig_name)?;
        let files: Vec<PathBuf> = self.poses.iter().map(|path| poses_of(path)).collect::<Result<_, _>>()?;
        let dataset = read_poses(files.iter().map(PathBuf::as_path), &robot, &rig)?;
        Ok(MeasuredInputs { robot, robot_source, rig, rig_name, dataset })
    }

    /// What was given, or else the sessions' file; they have to agree.
    fn of_sessions(&self, given: Option<&str>, what: SessionFile) -> Result<String, MeasuredError> {
        if let Some(given) = given {
            return Ok(given.to_owned());
        }
        let files: Vec<PathBuf> = self.poses.iter().map(|path| path.join(what.name())).filter(|file| file.is_file()).collect();
        let texts: Vec<Source> = files.iter().map(|file| Source::read_toml(file)).collect::<Result<_, _>>()?;
        match files.first() {
            None => Err(MeasuredError::Missing(what)),
            Some(_) if texts.windows(2).any(|pair| pair[0].text() != pair[1].text()) => Err(MeasuredError::SessionsDiffer(what)),
            Some(first) => Ok(first.display().to_string()),
        }
    }
}

/// The file itself, or a session's.
///
/// # Errors
/// [`MeasuredError::NoPosesYet`].
pub fn poses_of(path: &Path) -> Result<PathBuf, MeasuredError> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    let poses = path.join(POSES_NAME);
    if poses.is_file() { Ok(poses) } else { Err(MeasuredError::NoPosesYet(path.to_owned())) }
}
