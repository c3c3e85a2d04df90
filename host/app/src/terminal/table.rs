//! Plain tables: columns of numbers to the right, words to the left, no lines.

use comfy_table::{CellAlignment, Table, presets};

use crate::text::one_line;

pub(crate) use crate::units::fixed;

/// A table under construction.
pub(crate) struct Columns(Table);

impl Columns {
    /// Headings; one that begins with `<` is of words, the others are of numbers.
    pub(crate) fn new(headings: &[&str]) -> Self {
        let mut table = Table::new();
        table.load_style(presets::NOTHING).set_header(headings.iter().map(|heading| heading.trim_start_matches('<')));
        for (i, heading) in headings.iter().enumerate() {
            if let Some(column) = table.column_mut(i) {
                let alignment = if heading.starts_with('<') { CellAlignment::Left } else { CellAlignment::Right };
                column.set_padding((2, 0)).set_cell_alignment(alignment);
            }
        }
        Self(table)
    }

    /// One line.
    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.0.add_row(cells.into_iter().map(|cell| one_line(&cell).into_owned()));
    }

    /// The text, a newline behind each line and no white space before one.
    pub(crate) fn text(&self) -> String {
        self.0.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
    }
}
