//! The figures: one file each, from facts to SVG, a sentence and the numbers behind it.

mod canvas;
mod convergence;
mod correlation;
mod histogram;
mod joints;
mod pairings;
mod proof;
mod scene;
mod shell;
mod singular;
mod table;
mod thin;
mod time;
mod workspace;

use miette::Diagnostic;
use thiserror::Error;

use super::facts::Facts;
pub(super) use canvas::{CHUCKS, dark_rules, hex};
pub(super) use scene::wires_m;
pub use table::Table;
pub(super) use thin::drawn;

/// One figure of the page.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its file's name, without an end.
    pub name: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// What to see in it, or why it is not drawn.
    pub sentence: String,
    /// Takes the whole width of the page.
    pub wide: bool,
    /// None where there is nothing to draw.
    pub drawing: Option<Drawing>,
}

/// What is drawn, and from which numbers.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// A whole SVG document, which follows the reader's choice of light or dark.
    pub svg: String,
    /// The numbers behind it.
    pub data: Table,
}

/// Name, heading and width of a figure.
struct Frame {
    name: &'static str,
    title: &'static str,
    wide: bool,
}

impl Frame {
    fn drawn(self, svg: String, data: Table, sentence: String) -> Figure {
        let Self { name, title, wide } = self;
        Figure { name, title, sentence, wide, drawing: Some(Drawing { svg, data }) }
    }

    fn missing(self, why: &str) -> Figure {
        let Self { name, title, wide } = self;
        Figure { name, title, sentence: why.to_owned(), wide, drawing: None }
    }
}

/// The plotting library could not draw.
#[derive(Debug, Error, Diagnostic)]
#[error("figure {figure} cannot be drawn: {reason}")]
#[diagnostic(help("Numbers in it may be too large or too small to draw; --csv DIR writes those of the other figures."))]
pub struct FigureError {
    figure: &'static str,
    reason: String,
}

/// All figures, in the order of the page; those for which there is nothing to draw say why.
///
/// # Errors
/// [`FigureError`] when the plotting library refuses.
pub fn all(facts: &Facts) -> Result<Vec<Figure>, FigureError> {
    type Draw = fn(&Facts) -> Result<Figure, FigureError>;
    let draw: [Draw; 11] = [
        proof::figure,
        histogram::figure,
        shell::figure,
        singular::figure,
        convergence::figure,
        workspace::figure,
        pairings::figure,
        time::figure,
        joints::figure,
        scene::figure,
        correlation::figure,
    ];
    draw.iter().map(|draw| draw(facts)).collect()
}
