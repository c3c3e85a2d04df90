//! What the errors of the calibration library and of the procedures are called here, and what to do about them.

mod board;
mod collecting;

use std::borrow::Cow;
use std::error::Error;
use std::fmt;

use ballbar_calib::identify::FitError;
use ballbar_calib::kinematics::NothingAllowed;
use ballbar_calib::plan::{Cause, FixturesOverlap, PlanError};
use ballbar_calib::simulate::ShellError;
use ballbar_calib::units::mm_from_m;
use ballbar_calib::unknowns::{Kind, UnknownError};
use miette::Diagnostic;

/// An error of the library with the command's words. What has no [`Remedy`] cannot be shown.
#[derive(Debug)]
pub struct Remedied<E>(pub E);

/// A row of the table.
pub trait Remedy: Error + Send + Sync + 'static {
    /// What it is called, where the command has words for it that the library does not know.
    fn words(&self) -> Option<String> {
        None
    }

    /// What to do about it, where there is something.
    fn remedy(&self) -> Option<Cow<'static, str>>;
}

/// The help of an error within another that has its own.
fn own_help(error: &dyn Diagnostic) -> Option<Cow<'static, str>> {
    error.help().map(|help| help.to_string().into())
}

impl<E: Remedy> fmt::Display for Remedied<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.words() {
            Some(words) => f.write_str(&words),
            None => fmt::Display::fmt(&self.0, f),
        }
    }
}

impl<E: Remedy> Error for Remedied<E> {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.0.source()
    }
}

impl<E: Remedy> Diagnostic for Remedied<E> {
    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        self.0.remedy().map(|remedy| Box::new(remedy) as _)
    }
}

impl<E: Remedy> From<E> for Remedied<E> {
    fn from(error: E) -> Self {
        Self(error)
    }
}

impl Remedy for FitError {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        let words = match self {
            Self::NoRedundancy { .. } => "Measure more poses (the paper took some 800), or hold more parameters with --hold.",
            Self::NoSuchParameter(_) => "A robot of J joints has x1 … gamma1, offset1, scale1 up to gamma(J+1).",
        };
        Some(words.into())
    }
}

impl Remedy for UnknownError {
    fn words(&self) -> Option<String> {
        let (kind, why) = match self {
            Self::NoTolerance => (Kind::Rig, "no chuck or sphere that was measured with has a `tolerance_mm` above zero"),
            Self::NoRods => (Kind::BarGain, "neither rig nor poses say how long the bar is at mid travel"),
            Self::KnownExactly(kind) => (*kind, "the rig's [bar] says with a tolerance of 0 that it is known exactly"),
            Self::NoMotion => (Kind::Latency, "no length was measured in motion"),
            Self::NoSets => (Kind::Sets, "no pose names a set"),
            Self::NoOrder => (Kind::Drift, "neither times nor numbers of the poses tell the first from the last"),
            Self::NoMasses => (Kind::Compliance, "the robot's file has no `mass_kg` that a joint bears"),
            Self::NoDiscs => (Kind::Eccentricity, "all joints are prismatic"),
            Self::NoApproach => (Kind::Backlash, "no joint is known to have come to its poses from both sides"),
            _ => return None,
        };
        Some(format!("--unknown {}: {why}", kind.name()))
    }

    fn remedy(&self) -> Option<Cow<'static, str>> {
        let words = match self {
            Self::NoTolerance => {
                "Say in rig.toml how well the centres are known: `tolerance_mm` of a chuck or sphere, or once at the top for all."
            }
            Self::NoRods => "Give the rig a [bar] with `lengths_mm`, or the poses a column `bar_mm`.",
            Self::KnownExactly(Kind::BarGain) => "Leave it out, or give the [bar] of rig.toml the `gain_tolerance` that it has.",
            Self::KnownExactly(_) => "Leave it out, or give the [bar] of rig.toml the `zero_tolerance_mm` that it has.",
            Self::NoMotion => "Only poses that `host-cal collect` measures on the way tell it.",
            Self::NoSets => "Give the poses a column `set`.",
            Self::NoOrder => "A drift takes two poses or more, one after the other.",
            Self::NoMasses => "Give links their `mass_kg` and `center_mm` in robot.toml, and the payload where there is one.",
            Self::NoDiscs => "A slide's encoder has no disc: leave `eccentricity` out.",
            Self::NoApproach => "Give the poses a column `approach`: + or - for each joint, 0 where it is not known.",
            _ => return None,
        };
        Some(words.into())
    }
}

impl Remedy for NothingAllowed {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        Some("A command has to be within the limits of both: give one of the files the joint's true limits.".into())
    }
}

impl Remedy for ShellError {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        let Self::OutOfReach { .. } = self;
        Some("Move the chucks nearer to the robot, take another bar length with --bar, or ask for fewer poses.".into())
    }
}

impl Remedy for FixturesOverlap {
    fn remedy(&self) -> Option<Cow<'static, str>> {
        Some(match self.turned_plate_rad() {
            Some(away_rad) => turn_the_spheres(away_rad).into(),
            None => "Check the positions in rig.toml, or give the true sizes in its [solids] table (docs/files.md).".into(),
        })
    }
}

impl Remedy for PlanError {
    fn words(&self) -> Option<String> {
        match self {
            Self::TooFewToChoose { wanted, found } => {
                Some(format!("--optimal {wanted}: only {found} poses were found to choose from"))
            }
            Self::FewerThanParameters { wanted, parameters } => Some(format!(
                "--optimal {wanted}: these pairings tell {parameters} parameters, expected more poses than parameters"
            )),
            Self::Overlap(_) | Self::OutOfReach { .. } => None,
        }
    }

    fn remedy(&self) -> Option<Cow<'static, str>> {
        Some(match self {
            Self::Overlap(overlap) => return overlap.remedy(),
            Self::OutOfReach { cause, .. } => of_cause(cause),
            Self::TooFewToChoose { .. } => {
                "Ask for fewer, or give more to choose from with --per-pair, --bar or --pairings.".into()
            }
            Self::FewerThanParameters { .. } => "Ask for three times as many poses as parameters, or more.".into(),
        })
    }
}

fn of_cause(cause: &Cause) -> Cow<'static, str> {
    match cause {
        Cause::TurnedPlate(away_rad) => turn_the_spheres(*away_rad).into(),
        Cause::Links { radius_m, last_radius_m } => format!(
            "Every link counts as capsules of {:.0} mm radius, the last one of {:.0} mm: give the true ones as link_radius_mm and \
             last_link_radius_mm in the rig's [solids] table, or move the chucks away from the robot's foot.",
            mm_from_m(*radius_m),
            mm_from_m(*last_radius_m)
        )
        .into(),
        Cause::Table { below_chucks_m } => format!(
            "The table counts as an endless plane {:.0} mm below the lowest chuck: give its true height as table_below_chucks_mm in the \
             rig's [solids] table, and the links' true link_radius_mm, or set the chucks lower or farther out.",
            mm_from_m(*below_chucks_m)
        )
        .into(),
        Cause::Travel { travel_m, margin_m } => format!(
            "Of the {:.1} mm of travel to either side {:.1} mm are kept as a margin, and what is left has to hold the lengths of all \
             plausible robots: ask for less with --travel-margin-mm, or take a bar with more travel.",
            mm_from_m(*travel_m) / 2.0,
            mm_from_m(*margin_m)
        )
        .into(),
        Cause::Paths => "Postures were found, but no two that a path joins with the bar attached: ask for smaller margins, above all \
                         --clearance-mm and --travel-margin-mm, or for more points with --per-pair."
            .into(),
        Cause::Reach => "Move the chucks nearer to the robot or away from its foot, take another bar length with --bar, or ask for smaller \
                         margins."
            .into(),
    }
}

fn turn_the_spheres(away_rad: f64) -> String {
    format!(
        "The plate with the spheres faces {:.0}° away from the axis of the last joint, as the tool's frame is turned in the robot's file: \
         turn the spheres' positions in rig.toml, not those of the chucks.",
        away_rad.to_degrees()
    )
}
