//! Who talks all the time, besides the board.

use crate::robot_link::{LinkError, RobotLink};

/// To be heard several times a second, whatever is waited for meanwhile.
pub(super) trait Talker {
    /// Takes in what was said.
    fn hear(&mut self) -> Result<(), LinkError>;
}

impl<'r> Talker for &'r mut (dyn RobotLink + 'r) {
    fn hear(&mut self) -> Result<(), LinkError> {
        self.listen()
    }
}

/// No controller is on line.
pub(super) struct Nobody;

impl Talker for Nobody {
    fn hear(&mut self) -> Result<(), LinkError> {
        Ok(())
    }
}
