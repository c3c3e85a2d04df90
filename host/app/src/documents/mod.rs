//! Documents of results, which commands print as JSON and others can make: in the units of the screen, without the words of any command.

mod fit;
mod lines;
mod margins;
mod plan;
mod unknowns;

pub use fit::{FitDocument, Fitted, FoldsLine, OutlierLine, PairingChange, ParameterLine};
pub use lines::{HeldOutRows, NotIdentified, PairingLine, ResidualLine, largest};
pub use margins::{CheckDocument, Least, MarginLine};
pub use plan::{ComparisonLine, PlanDocument, QualityLine, Reason, RowLine, RowMarginLine, ShellLine};
pub use unknowns::{CannotTell, EstimateLine, ScoreLine, TriedLine, UnknownsDocument};
