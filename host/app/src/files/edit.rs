//! Numbers of a TOML text replaced, with all that people have written around them kept.

use toml_edit::{Item, value};

/// Replaces a number and keeps the comment behind it.
pub(super) fn set_number(item: &mut Item, number: f64) {
    let decor = item.as_value().map(|old| old.decor().clone());
    *item = value(number);
    if let (Some(new), Some(decor)) = (item.as_value_mut(), decor) {
        *new.decor_mut() = decor;
    }
}

/// Replaces the numbers of a list, one by one, so that what stands between them is kept.
pub(super) fn set_numbers(item: &mut Item, numbers: impl Iterator<Item = f64>) {
    if let Some(array) = item.as_array_mut() {
        for (i, number) in numbers.enumerate() {
            array.replace(i, number);
        }
    }
}
