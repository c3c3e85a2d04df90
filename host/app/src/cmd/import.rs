//! `host-cal import`: a robot file from a URDF.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::inputs::{ForceArgs, OutputArgs};
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print, warn, write_file};
use crate::files::{FileKind, Output, UrdfEnds, read_urdf};
use crate::text::{one_line, shown_path};

/// Make a robot file from a URDF
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal import ur5e.urdf --base base_link --tip tool0 --out ur5e.toml\n\nJoints about other axes than z become joints about z; expand a xacro file first."
)]
pub(super) struct ImportArgs {
    /// The URDF
    urdf: PathBuf,
    /// Link that the chain begins with; the root when not given
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// Link that is the tool; the end of the tree when it has only one
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// File to write; printed when not given
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replace: ForceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct ImportReport {
    robot: String,
    base: String,
    tip: String,
    /// Names of the joints, from the base.
    joints: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<PathBuf>,
    /// The robot file, where it was not written.
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    warnings: Vec<String>,
}

impl ImportArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let ends = UrdfEnds { base: self.base.as_deref(), tip: self.tip.as_deref() };
        let imported = read_urdf(&self.urdf, ends)?;
        for remark in &imported.remarks {
            warn(remark);
        }
        if let Some(path) = &self.out {
            write_file(Output { path, kind: FileKind::Robot, force: self.replace.force }, &imported.toml)?;
        }
        let report = ImportReport {
            robot: imported.robot.name,
            base: imported.base,
            tip: imported.tip,
            joints: imported.joints,
            out: self.out.clone(),
            text: self.out.is_none().then_some(imported.toml),
            warnings: imported.remarks,
        };
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }
}

impl Report for ImportReport {
    fn is_document(&self) -> bool {
        self.text.is_some()
    }

    fn text(&self) -> String {
        if let Some(text) = &self.text {
            return text.clone();
        }
        let out = self.out.as_deref().map_or_else(String::new, shown_path);
        let chain = format!("{} from link {} to link {}", self.robot, self.base, self.tip);
        format!("{} is written to {out}\njoints: {}\n", one_line(&chain), one_line(&self.joints.join(", ")))
    }
}
