//! Columns of an exported log, the same for all formats.

/// How a value is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColumnType {
    /// 32 bits without a sign.
    Unsigned32,
    /// 32 bits with a sign.
    Signed32,
    /// 64 bits with a sign.
    Signed64,
    /// True or false.
    Flag,
    /// A number rounded to so many decimals, the same in every format.
    Real { decimals: usize },
}

/// A column.
#[derive(Clone, Debug)]
pub(super) struct Column {
    /// Its name, with the unit at its end where it has one.
    pub(super) name: String,
    /// Its unit: `us`, `deg`, `mm`, or `1` for numbers, counts and codes.
    pub(super) unit: &'static str,
    /// How its values are kept.
    pub(super) column_type: ColumnType,
    /// Whether values may be unknown.
    pub(super) is_optional: bool,
}
