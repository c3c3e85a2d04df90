//! Documents of results, which commands print as JSON and others can make: in the units of the screen, without the words of any command.

mod fit;
mod lines;

pub use fit::{FitDocument, Fitted, FoldsLine, OutlierLine, PairingChange, ParameterLine};
pub use lines::{HeldOutRows, NotIdentified, PairingLine, ResidualLine, largest};
