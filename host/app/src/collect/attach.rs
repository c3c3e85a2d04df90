//! Attaching the bar, and whether what is attached is what was asked for.

use std::time::{Duration, Instant};

use ballbar::JointVector;
use ballbar_calib::model::PairingId;

use super::collector::{Bar, Collector};
use super::errors::CollectError;
use super::ledger::Joined;
use super::operator::{Event, Wish};
use super::talker::Talker;
use crate::units::{mm_from_m, tidy};

/// How long the LVDT may take to show a bar that was attached.
const PATIENCE: Duration = Duration::from_secs(3);
/// The operator is asked so often for the same connection.
const ATTEMPTS: usize = 3;
/// A bar that hangs free does not keep its length so well; one that is on rings no further.
const STILL_ON_M: f64 = 5e-4;
/// The bar is still moved by the hand that attached it for so long, by the board's clock.
const STEADY_US: u64 = 200_000;

impl Collector<'_, '_> {
    /// Has the bar attached, and looks whether it is the right one. True when the operator wants to end instead.
    pub(super) fn attach(&mut self, joined: Joined, talker: &mut dyn Talker) -> Result<bool, CollectError> {
        if matches!(self.bar, Bar::On(_)) && self.detach(talker)? {
            return Ok(true);
        }
        let connection = self.connection(joined);
        for attempt in 1.. {
            self.operator.tell(&Event::Attach(&connection))?;
            if self.wait_for_confirmation(talker)? {
                return Ok(true);
            }
            match self.look_at_connection(joined, talker) {
                Ok(()) => break,
                Err(wrong @ CollectError::WrongConnection { .. }) if attempt < ATTEMPTS => self.trouble(wrong.to_string())?,
                Err(error) => return Err(error),
            }
        }
        self.believe_on(joined)?;
        self.rearm()?;
        Ok(false)
    }

    /// Has the bar taken off, unless it is known to be off. True when the operator wants to end instead.
    pub(super) fn detach(&mut self, talker: &mut dyn Talker) -> Result<bool, CollectError> {
        let connection = match self.bar {
            Bar::Off => return Ok(false),
            Bar::Unknown => None,
            Bar::On(joined) => Some(self.connection(joined)),
        };
        self.board.recorder().connect(None)?;
        let before_m = self.board.ask()?.displacement_m;
        for attempt in 1..=ATTEMPTS {
            self.operator.tell(&Event::Detach(connection.as_ref()))?;
            if self.wait_for_confirmation(talker)? {
                return Ok(true);
            }
            let confirmed_us = self.board.ask()?.t_us;
            let now_m = self.board.view_after(confirmed_us + STEADY_US)?.displacement_m;
            let is_as_before = before_m.zip(now_m).is_some_and(|(before_m, now_m)| (now_m - before_m).abs() < STILL_ON_M);
            // Of a bar of which nothing is known, a length that stays may be that of one that hangs free.
            if !is_as_before || connection.is_none() {
                break;
            }
            if attempt == ATTEMPTS {
                return Err(CollectError::StillOn { why: "the LVDT shows the same length as before".into() });
            }
            self.trouble("the LVDT shows the same length as before: is the bar off?".into())?;
        }
        self.bar = Bar::Off;
        Ok(false)
    }

    /// The bar is on, which the LVDT has shown.
    pub(super) fn believe_on(&mut self, joined: Joined) -> Result<(), CollectError> {
        let connection = self.connection(joined);
        self.bar = Bar::On(joined);
        self.board.recorder().connect(Some(connection.clone()))?;
        Ok(self.operator.tell(&Event::Attached(&connection))?)
    }

    /// Nobody knows where the bar is any more.
    pub(super) fn lose_bar(&mut self) -> Result<(), CollectError> {
        self.bar = Bar::Unknown;
        Ok(self.board.recorder().connect(None)?)
    }

    /// Whether the bar that the LVDT shows now, if any, can be this one at the arm's place.
    pub(super) fn is_plausible(&mut self, joined: Joined) -> Result<bool, CollectError> {
        let view = self.board.ask()?;
        Ok(view.displacement_m.is_some_and(|found_m| self.misfit(joined, &view.q, found_m) <= 1.0))
    }

    /// True when the operator wants to end.
    pub(super) fn wait_for_confirmation(&mut self, talker: &mut dyn Talker) -> Result<bool, CollectError> {
        loop {
            self.listen(talker)?;
            match self.operator.wish() {
                Some(Wish::Confirm | Wish::Resume) => return Ok(false),
                Some(Wish::Quit) => return Ok(true),
                Some(later) => self.wishes.push_back(later),
                None => {}
            }
        }
    }

    fn look_at_connection(&mut self, joined: Joined, talker: &mut dyn Talker) -> Result<(), CollectError> {
        let (began, confirmed_us) = (Instant::now(), self.board.ask()?.t_us);
        let mut shown_since_us = None;
        while began.elapsed() < PATIENCE {
            self.listen(talker)?;
            let view = self.board.view_after(confirmed_us)?;
            match view.displacement_m {
                None => shown_since_us = None,
                Some(found_m) => {
                    let since_us = *shown_since_us.get_or_insert(view.t_us);
                    if view.t_us.saturating_sub(since_us) >= STEADY_US {
                        return self.judge(joined, &view.q, Some(found_m));
                    }
                }
            }
        }
        let q = self.board.view()?.q;
        self.judge(joined, &q, None)
    }

    fn judge(&self, joined: Joined, q: &JointVector<f64>, found_m: Option<f64>) -> Result<(), CollectError> {
        if found_m.is_some_and(|found_m| self.misfit(joined, q, found_m) <= 1.0) {
            return Ok(());
        }
        let (expected_m, reserve_m) = self.expected_m(joined, q);
        let hint = match found_m.and_then(|found_m| self.better(joined, q, found_m)) {
            Some(other) => format!("It looks like {}. Attach the bar as asked for, and confirm.", self.words(other)),
            None => "Are both magnets on, is it the right extension rod? Attach the bar as asked for, and confirm.".into(),
        };
        Err(CollectError::WrongConnection {
            connection: self.words(joined),
            found: found_m.map_or("the LVDT shows no bar within its travel".into(), |found_m| {
                format!("the LVDT shows {:+.1} mm from mid travel", mm_from_m(found_m))
            }),
            expected: format!("{:+.1} ± {:.1} mm", mm_from_m(expected_m), mm_from_m(reserve_m)),
            hint,
        })
    }

    /// Displacement that the model expects, and how far plausible robots may be off it, metres.
    fn expected_m(&self, (pairing, bar_m): Joined, q: &JointVector<f64>) -> (f64, f64) {
        let (length_m, reserve_m) = self.cell.length(q, &self.cell.rig.pairing(pairing));
        (length_m - bar_m, reserve_m)
    }

    /// Distance of a displacement from the expected one, as a share of what is plausible.
    fn misfit(&self, joined: Joined, q: &JointVector<f64>, found_m: f64) -> f64 {
        let (expected_m, reserve_m) = self.expected_m(joined, q);
        (found_m - expected_m).abs() / reserve_m
    }

    /// The connection of this rig that fits a displacement, and best.
    fn better(&self, than: Joined, q: &JointVector<f64>, found_m: f64) -> Option<Joined> {
        let rig = self.cell.rig;
        let bars = rig.bar.iter().flat_map(|bar| bar.lengths_m.iter().copied());
        let all: Vec<Joined> =
            bars.flat_map(|bar_m| rig.all_pairings().into_iter().map(move |pairing: PairingId| (pairing, bar_m))).collect();
        let misfit = |joined: &Joined| self.misfit(*joined, q, found_m);
        let best = all.into_iter().filter(|joined| *joined != than).min_by(|a, b| misfit(a).total_cmp(&misfit(b)))?;
        (misfit(&best) <= 1.0).then_some(best)
    }

    fn words(&self, (pairing, bar_m): Joined) -> String {
        format!("{} with the {} mm bar", self.cell.rig.pairing_name(pairing), tidy(mm_from_m(bar_m)))
    }
}
