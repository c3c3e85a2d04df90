//! The figures: one file each, from facts to SVG, a sentence and the numbers behind it.

mod canvas;
mod convergence;
mod correlation;
mod histogram;
mod joints;
mod pairings;
mod proof;
mod shell;
mod singular;
mod table;
mod time;
mod workspace;

use miette::Diagnostic;
use thiserror::Error;

use super::facts::Facts;
pub(super) use canvas::dark_rules;
pub use table::Table;

/// One figure of the page.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its file's name, without an end.
    pub name: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// What to see in it.
    pub sentence: String,
    /// A whole SVG document, which follows the reader's choice of light or dark.
    pub svg: String,
    /// The numbers behind it.
    pub data: Table,
    /// Takes the whole width of the page.
    pub wide: bool,
}

/// The plotting library could not draw.
#[derive(Debug, Error, Diagnostic)]
#[error("figure {figure} cannot be drawn: {reason}")]
#[diagnostic(help("Numbers in it may be too large or too small to draw; --csv DIR writes those of the other figures."))]
pub struct FigureError {
    figure: &'static str,
    reason: String,
}

/// All figures that these facts allow, in the order of the page.
///
/// # Errors
/// [`FigureError`] when the plotting library refuses.
pub fn all(facts: &Facts) -> Result<Vec<Figure>, FigureError> {
    type Draw = fn(&Facts) -> Result<Option<Figure>, FigureError>;
    let draw: [Draw; 10] = [
        proof::figure,
        shell::figure,
        histogram::figure,
        singular::figure,
        convergence::figure,
        workspace::figure,
        pairings::figure,
        time::figure,
        joints::figure,
        correlation::figure,
    ];
    draw.iter().filter_map(|draw| draw(facts).transpose()).collect()
}
