//! The parameters in use, those that wait to be, and their way into flash.

use ballbar::LvdtCurve;
use ballbar::wire::{CompiledParameters, ParameterSet, Refusal, SetIdentity, SlotState, WhichSet};

use crate::log::{info, warning};
use crate::slots::{Slots, set_crc};
use crate::{ENCODERS, ParameterFlash};

/// Parameters of a board. Nothing changes those in use but a commit that succeeded.
pub(crate) struct Parameters {
    slots: Slots,
    active: Option<Active>,
    previous: Option<SetIdentity>,
    staged: Option<Staged>,
}

struct Active {
    identity: SetIdentity,
    compiled: CompiledParameters,
}

struct Staged {
    set: ParameterSet,
    compiled: CompiledParameters,
    crc: u32,
}

impl Parameters {
    /// None, before the flash was looked into.
    pub(crate) fn none() -> Self {
        Self { slots: Slots::unread(), active: None, previous: None, staged: None }
    }

    /// Takes into use what the flash holds.
    pub(crate) fn load(flash: &mut impl ParameterFlash) -> Self {
        let (slots, set) = Slots::load(flash);
        // A whole set that this firmware cannot use was written by another one; it stays in flash, unused. So does the one before:
        // it is not the robot's any more.
        let active = set.and_then(|set| Staged::check(set).ok()).map(|staged| Active::new(staged, &slots));
        if active.is_none() {
            warning!("no parameters in flash");
        }
        let mut parameters = Self { slots, active, previous: None, staged: None };
        parameters.identify_previous(flash);
        parameters
    }

    /// Not inlined, so that the set does not lie on the stack beside the one that was loaded.
    #[inline(never)]
    fn identify_previous(&mut self, flash: &mut impl ParameterFlash) {
        self.previous = self.slots.read_previous(flash).map(|(sequence, crc, set)| identity(&set, sequence, crc));
    }

    pub(crate) fn active(&self) -> Option<&CompiledParameters> {
        self.active.as_ref().map(|active| &active.compiled)
    }

    pub(crate) fn identity(&self) -> Option<&SetIdentity> {
        self.active.as_ref().map(|active| &active.identity)
    }

    /// What was in use before, and still stands in flash.
    pub(crate) fn previous(&self) -> Option<&SetIdentity> {
        self.previous.as_ref()
    }

    pub(crate) fn staged_crc(&self) -> Option<u32> {
        self.staged.as_ref().map(|staged| staged.crc)
    }

    pub(crate) fn slots(&self) -> [SlotState; 2] {
        self.slots.states()
    }

    pub(crate) fn compiled(&self, which: WhichSet) -> Result<&CompiledParameters, Refusal> {
        let compiled = match which {
            WhichSet::Active => self.active(),
            WhichSet::Staged => self.staged.as_ref().map(|staged| &staged.compiled),
        };
        compiled.ok_or(Refusal::NoParameters)
    }

    /// The set itself; that in use is read from flash, so that the answer is what is stored.
    pub(crate) fn read(&self, which: WhichSet, flash: &mut impl ParameterFlash) -> Result<ParameterSet, Refusal> {
        match (which, &self.active, &self.staged) {
            (WhichSet::Active, Some(active), _) => {
                // A slot that has rotted since gives the set before, which is not the one in use.
                let stored = Slots::load(flash).1.filter(|set| set_crc(set) == Some(active.identity.crc));
                stored.ok_or(Refusal::Flash)
            }
            (WhichSet::Staged, _, Some(staged)) => Ok(staged.set.clone()),
            _ => Err(Refusal::NoParameters),
        }
    }

    /// The set that was in use before, as it stands in flash.
    pub(crate) fn read_previous(&self, flash: &mut impl ParameterFlash) -> Result<ParameterSet, Refusal> {
        let previous = self.previous.as_ref().ok_or(Refusal::NoPrevious)?;
        let stored = self.slots.read_previous(flash).filter(|(_, crc, _)| *crc == previous.crc);
        stored.map(|(_, _, set)| set).ok_or(Refusal::Flash)
    }

    pub(crate) fn stage(&mut self, set: ParameterSet) -> Result<u32, Refusal> {
        let staged = Staged::check(set)?;
        let crc = staged.crc;
        self.staged = Some(staged);
        Ok(crc)
    }

    /// Another LVDT curve for the staged set; when none is staged, the one in use is staged with it.
    pub(crate) fn stage_lvdt(&mut self, lvdt: LvdtCurve, flash: &mut impl ParameterFlash) -> Result<u32, Refusal> {
        if !lvdt.is_valid() {
            return Err(Refusal::LvdtCurve);
        }
        let base = if self.staged.is_some() { WhichSet::Staged } else { WhichSet::Active };
        let set = self.read(base, flash)?;
        self.stage(ParameterSet { lvdt, ..set })
    }

    pub(crate) fn discard(&mut self) {
        self.staged = None;
    }

    /// Whether a commit of this CRC has nothing left to do.
    pub(crate) fn is_committed(&self, crc: u32) -> bool {
        self.staged.is_none() && self.identity().is_some_and(|identity| identity.crc == crc)
    }

    /// Stores the staged set and takes it into use.
    pub(crate) fn commit(&mut self, crc: u32, flash: &mut impl ParameterFlash) -> Result<(), Refusal> {
        match &self.staged {
            None => return Err(Refusal::NoParameters),
            Some(staged) if staged.crc != crc => return Err(Refusal::OtherCrc { staged: staged.crc }),
            Some(staged) => {
                if self.slots.commit(flash, &staged.set).is_err() {
                    warning!("the flash did not take the parameters");
                    return Err(Refusal::Flash);
                }
            }
        }
        info!("parameters committed");
        self.active = self.staged.take().map(|staged| Active::new(staged, &self.slots));
        self.identify_previous(flash);
        Ok(())
    }
}

impl Active {
    fn new(staged: Staged, slots: &Slots) -> Self {
        let sequence = slots.active().map_or(0, |(sequence, _)| sequence);
        Self { identity: identity(&staged.set, sequence, staged.crc), compiled: staged.compiled }
    }
}

fn identity(set: &ParameterSet, sequence: u32, crc: u32) -> SetIdentity {
    SetIdentity { name: set.name.clone(), is_calibrated: set.is_calibrated, joints: set.kinds.len() as u8, sequence, crc }
}

impl Staged {
    fn check(set: ParameterSet) -> Result<Self, Refusal> {
        let compiled = set.compile().map_err(Refusal::Parameters)?;
        if compiled.joints > ENCODERS {
            return Err(Refusal::TooManyJoints { joints: compiled.joints as u8, encoders: ENCODERS as u8 });
        }
        let crc = set_crc(&set).ok_or(Refusal::Flash)?;
        Ok(Self { set, compiled, crc })
    }
}
