//! Log lines by defmt where there is a probe to read them, and nothing on the host.

macro_rules! info {
    ($($arguments:tt)*) => {{
        #[cfg(feature = "defmt")]
        defmt::info!($($arguments)*);
    }};
}

macro_rules! warning {
    ($($arguments:tt)*) => {{
        #[cfg(feature = "defmt")]
        defmt::warn!($($arguments)*);
    }};
}

pub(crate) use {info, warning};
