//! Numbers behind a figure.

/// Columns with headings that carry units.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// One a column.
    pub headings: Vec<String>,
    /// As many fields as there are headings.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Without rows.
    pub(in crate::report) fn new<const N: usize>(headings: [&str; N]) -> Self {
        Self { headings: headings.map(str::to_owned).to_vec(), rows: Vec::new() }
    }

    /// With a row of words and numbers.
    pub(in crate::report) fn row<const N: usize>(&mut self, fields: [String; N]) {
        self.rows.push(fields.to_vec());
    }

    /// As a CSV file.
    pub fn csv(&self) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for record in std::iter::once(&self.headings).chain(&self.rows) {
            // Writing to memory cannot fail.
            let _ = writer.write_record(record);
        }
        String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
    }
}

/// A number with nine digits, enough for any plot.
pub(super) fn number(value: f64) -> String {
    format!("{value:.9}")
}
