//! How a command begins to record.

use ballbar::JointKind;

use super::outcome::{CommandError, record_error};
use super::report::warn;
use crate::session::{Recorder, Run, SessionLock};

/// Begins a run, whose log begins with what the board has said of itself. Poses go to poses.csv where the kinds of the joints are given.
pub(super) fn begin_recording(
    lock: &SessionLock,
    run: Run,
    kinds: Option<&[JointKind]>,
    said: &[&[u8]],
) -> Result<Recorder, CommandError> {
    let mut recorder = Recorder::begin(lock, run, kinds).map_err(record_error)?;
    // Poses of a run that was killed are no surprise, but nothing to hide.
    if recorder.recovered() > 0 {
        warn(&format!("{} poses that the log held and poses.csv lacked were written into it", recorder.recovered()));
    }
    said.iter().try_for_each(|frame| recorder.frame(frame)).map_err(record_error)?;
    Ok(recorder)
}
