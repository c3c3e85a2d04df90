//! How often what is drawn at random is drawn: seldom enough to wait for, and at length where `./check --long` asks for it.

/// What [`at_length`] multiplies by; `BALLBAR_LONG`, and 1 where it is not set.
pub fn times() -> usize {
    match std::env::var("BALLBAR_LONG") {
        Ok(text) => text.parse().unwrap_or_else(|_| panic!("BALLBAR_LONG={text}: expected a whole number")),
        Err(_) => 1,
    }
}

/// A usual number of draws, as many times as is asked for.
pub fn at_length(usual: usize) -> usize {
    usual * times()
}
