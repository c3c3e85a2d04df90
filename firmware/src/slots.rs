//! Parameters in flash, in two slots of which one is always whole.
//!
//! A slot is a header and a set as postcard, little-endian:
//!
//! | bytes | |
//! | --- | --- |
//! | 0..4 | magic `BBPS` |
//! | 4..8 | layout: hash of the set's type, so that a set of another layout is never misread; that of the firmware before is read too |
//! | 8..12 | sequence, one more at every commit |
//! | 12..16 | length of the set, bytes |
//! | 16..20 | CRC-32 over bytes 0 to 16 and the set |
//! | 20.. | the set, padded with ones to the flash's word |
//! | 1024.. | up to 16 renewals of 32 bytes, where the slot has room: a later sequence, CRC-32 over the CRC-32 of the set's bytes and it, ones |
//!
//! A commit erases and writes the older slot, the set first and its header last, and reads it back; the newer slot is not touched
//! until then. Whatever byte the power fails at, the newer slot is whole, or the one just written is. The first commit ever writes
//! both, so that from then on one slot may also be lost to a flipped bit.
//!
//! A commit of the set that stands in the older slot erases nothing: it writes a renewal there, which makes that slot the newer one.
//! So whoever goes back to the set before loses neither of the two, whatever byte the power fails at. A commit of the set that is
//! in use already writes nothing, so that it does not cost the one before.

use ballbar::wire::{ParameterSet, SlotState};
use ballbar::{crc32, crc32_digest};
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use postcard_schema::key::Key;

use crate::ParameterFlash;

const MAGIC: [u8; 4] = *b"BBPS";
const LAYOUT: [u8; 4] = {
    let key = Key::for_path::<ParameterSet>("slot").to_bytes();
    [key[0], key[1], key[2], key[3]]
};
/// What the firmware of protocol 2 wrote, hashed as [`LAYOUT`] was then: a set without terms, which is the last field and may be missing.
/// Such a slot is read, renewed and kept as one of this layout.
const LAYOUT_WITHOUT_TERMS: [u8; 4] = [0xcb, 0xc2, 0x41, 0x8e];
/// Terms of no numbers, as postcard writes them.
const NO_TERMS: u8 = 0;
const HEADER_BYTES: usize = 20;
/// The longest set, with room to grow.
const MAX_SET_BYTES: usize = 1004;
/// The most bytes that a header and its set take.
pub const SLOT_IMAGE_BYTES: usize = HEADER_BYTES + MAX_SET_BYTES;
/// Renewals of a slot, until it is erased again.
const RENEWALS: usize = 16;
/// Whole words of any flash: the longest that are known have 32 bytes.
const RENEWAL_BYTES: usize = 32;

type Image = [u8; SLOT_IMAGE_BYTES];

/// What stands in the two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slots {
    states: [SlotState; 2],
}

/// Why parameters were not stored. The old ones are still there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommitError {
    /// The set does not fit into a slot.
    TooLong,
    /// The flash could not be read, erased or written.
    Flash,
    /// What was written reads back as something else.
    ReadBack,
}

impl Slots {
    /// Before the flash was looked into.
    pub(crate) fn unread() -> Self {
        Self { states: [SlotState::Empty; 2] }
    }

    /// Reads both slots; returns the newest whole set as well.
    pub fn load(flash: &mut impl ParameterFlash) -> (Self, Option<ParameterSet>) {
        let slots = Self { states: [0, 1].map(|slot| state_of(flash, slot)) };
        // Read once more, so that never two sets lie on the stack.
        let newest = slots.newest().and_then(|slot| read_slot(flash, slot).ok()?.1);
        (slots, newest.map(|stored| stored.set))
    }

    /// The two places.
    pub fn states(&self) -> [SlotState; 2] {
        self.states
    }

    /// Sequence and CRC-32 of the set in use.
    pub fn active(&self) -> Option<(u32, u32)> {
        match self.states[self.newest()?] {
            SlotState::Good { sequence, crc } => Some((sequence, crc)),
            _ => None,
        }
    }

    /// Stores a set; it is then the newest.
    ///
    /// # Errors
    /// [`CommitError`]; the newest set before is the newest still.
    pub fn commit(&mut self, flash: &mut impl ParameterFlash, set: &ParameterSet) -> Result<(), CommitError> {
        // As they are now: a slot that was good at start may have rotted since, and the other one is then not to be erased.
        // One that cannot be read may be the good one.
        let mut holds_it = [false; 2];
        for (slot, state) in self.states.iter_mut().enumerate() {
            let (found, stored) = read_slot(flash, slot)?;
            *state = found;
            holds_it[slot] = stored.is_some_and(|stored| is_same(&stored.set, set));
        }
        let sequence = self.active().map_or(0, |(sequence, _)| sequence.wrapping_add(1));
        let oldest = self.newest().map_or(0, |newest| 1 - newest);
        let is_good = |state: &SlotState| matches!(state, SlotState::Good { .. });
        if self.states.iter().all(is_good) && (holds_it[1 - oldest] || holds_it[oldest] && self.renew(flash, oldest, sequence)?) {
            return Ok(());
        }
        self.write(flash, oldest, sequence, set)?;
        if !is_good(&self.states[1 - oldest]) {
            // The set is stored already; without its copy, the slots' states say so.
            let _ = self.write(flash, 1 - oldest, sequence, set);
        }
        Ok(())
    }

    /// What was in use before the newest set, with its sequence and CRC-32; none where both slots hold the same, or the other one is
    /// not whole.
    pub fn read_previous(&self, flash: &mut impl ParameterFlash) -> Option<(u32, u32, ParameterSet)> {
        let (_, newest_crc) = self.active()?;
        match read_slot(flash, 1 - self.newest()?) {
            Ok((SlotState::Good { sequence, crc }, Some(stored))) if crc != newest_crc => Some((sequence, crc, stored.set)),
            _ => None,
        }
    }

    fn newest(&self) -> Option<usize> {
        match self.states {
            [SlotState::Good { sequence: a, .. }, SlotState::Good { sequence: b, .. }] => {
                Some(usize::from(b.wrapping_sub(a) as i32 > 0))
            }
            [SlotState::Good { .. }, _] => Some(0),
            [_, SlotState::Good { .. }] => Some(1),
            _ => None,
        }
    }

    /// Makes a whole slot the newest as it stands; false where it has no room for another renewal. A flash that fails is no reason
    /// to erase the slot.
    fn renew<F: ParameterFlash>(&mut self, flash: &mut F, slot: usize, sequence: u32) -> Result<bool, CommitError> {
        let (SlotState::Good { crc, .. }, Some(stored)) = read_slot(flash, slot)? else { return Ok(false) };
        let is_free = |at: &u32| read_renewal(flash, *at).is_ok_and(|bytes| bytes == [0xff; RENEWAL_BYTES]);
        let Some(free) = renewals::<F>(slot).find(is_free) else { return Ok(false) };
        let written = flash.write(free, &renewal(stored.bytes_crc, sequence));
        // What reads back counts, whatever the flash says of it: it is what the next start finds.
        let renewed = SlotState::Good { sequence, crc };
        if read_slot(flash, slot)?.0 == renewed {
            self.states[slot] = renewed;
            return Ok(true);
        }
        Err(if written.is_err() { CommitError::Flash } else { CommitError::ReadBack })
    }

    fn write(
        &mut self,
        flash: &mut impl ParameterFlash,
        slot: usize,
        sequence: u32,
        set: &ParameterSet,
    ) -> Result<(), CommitError> {
        let mut image: Image = [0xff; SLOT_IMAGE_BYTES];
        let length = image_of(sequence, set, &mut image)?;
        self.states[slot] = SlotState::Damaged;
        write_image(flash, slot, &image, length).map_err(|()| CommitError::Flash)?;
        let (state, stored) = read_slot(flash, slot)?;
        self.states[slot] = state;
        if stored.as_ref().is_some_and(|stored| is_same(&stored.set, set)) { Ok(()) } else { Err(CommitError::ReadBack) }
    }
}

/// CRC-32 of a set as it is stored; what a host commits with.
pub(crate) fn set_crc(set: &ParameterSet) -> Option<u32> {
    let mut image: Image = [0xff; SLOT_IMAGE_BYTES];
    let length = image_of(0, set, &mut image).ok()?;
    Some(crc32(&image[HEADER_BYTES..length]))
}

/// To the bit, which `==` on floats is not.
fn is_same(a: &ParameterSet, b: &ParameterSet) -> bool {
    a == b && set_crc(a) == set_crc(b)
}

/// Header and set; returns their length together.
fn image_of(sequence: u32, set: &ParameterSet, image: &mut Image) -> Result<usize, CommitError> {
    let length = postcard::to_slice(set, &mut image[HEADER_BYTES..]).map_err(|_| CommitError::TooLong)?.len();
    image[0..4].copy_from_slice(&MAGIC);
    image[4..8].copy_from_slice(&LAYOUT);
    image[8..12].copy_from_slice(&sequence.to_le_bytes());
    image[12..16].copy_from_slice(&(length as u32).to_le_bytes());
    let crc = image_crc(&image[..HEADER_BYTES + length]);
    image[16..20].copy_from_slice(&crc.to_le_bytes());
    Ok(HEADER_BYTES + length)
}

/// Over everything but the CRC itself.
fn image_crc(image: &[u8]) -> u32 {
    let mut digest = crc32_digest();
    digest.update(&image[..16]);
    digest.update(&image[HEADER_BYTES..]);
    digest.finalize()
}

/// Erases the slot, writes the set, then the header that makes it valid. The word in which the two meet goes with the header.
fn write_image<F: ParameterFlash>(flash: &mut F, slot: usize, image: &Image, length: usize) -> Result<(), ()> {
    let word = <F as NorFlash>::WRITE_SIZE;
    let start = slot as u32 * F::SLOT_BYTES;
    let header = HEADER_BYTES.next_multiple_of(word);
    let end = length.next_multiple_of(word);
    if end > SLOT_IMAGE_BYTES || end > F::SLOT_BYTES as usize {
        return Err(());
    }
    flash.erase(start, start + F::SLOT_BYTES).map_err(|_| ())?;
    flash.write(start + header as u32, &image[header..end]).map_err(|_| ())?;
    flash.write(start, &image[..header]).map_err(|_| ())
}

/// Not inlined, so that the set that is read with it leaves the stack.
#[inline(never)]
fn state_of(flash: &mut impl ParameterFlash, slot: usize) -> SlotState {
    read_slot(flash, slot).map_or(SlotState::Damaged, |(state, _)| state)
}

/// A set in flash.
struct Stored {
    set: ParameterSet,
    /// CRC-32 of its bytes as they stand there: of another layout not the set's.
    bytes_crc: u32,
}

/// Not inlined, so that its kilobytes do not lie on the stack of every caller.
#[inline(never)]
fn read_slot<F: ParameterFlash>(flash: &mut F, slot: usize) -> Result<(SlotState, Option<Stored>), CommitError> {
    let mut image: Image = [0; SLOT_IMAGE_BYTES];
    let length = SLOT_IMAGE_BYTES.min(F::SLOT_BYTES as usize) / <F as ReadNorFlash>::READ_SIZE * <F as ReadNorFlash>::READ_SIZE;
    flash.read(slot as u32 * F::SLOT_BYTES, &mut image[..length]).map_err(|_| CommitError::Flash)?;
    if image[..HEADER_BYTES].iter().all(|&byte| byte == 0xff) {
        return Ok((SlotState::Empty, None));
    }
    let Some((sequence, crc, stored)) = parse(&mut image[..length]) else { return Ok((SlotState::Damaged, None)) };
    let sequence = last_renewal(flash, slot, stored.bytes_crc)?.unwrap_or(sequence);
    Ok((SlotState::Good { sequence, crc }, Some(stored)))
}

/// Sequence, CRC-32 of the set as this firmware writes it, and the set.
fn parse(image: &mut [u8]) -> Option<(u32, u32, Stored)> {
    let word = |image: &[u8], at: usize| Some(u32::from_le_bytes(image.get(at..at + 4)?.try_into().ok()?));
    let (sequence, length, crc) = (word(image, 8)?, word(image, 12)?, word(image, 16)?);
    let mut end = HEADER_BYTES.checked_add(usize::try_from(length).ok()?)?;
    let written = image.get(..end)?;
    let lacks_terms = written[4..8] == LAYOUT_WITHOUT_TERMS;
    if written[0..4] != MAGIC || !(lacks_terms || written[4..8] == LAYOUT) || image_crc(written) != crc {
        return None;
    }
    let bytes_crc = crc32(&written[HEADER_BYTES..]);
    if lacks_terms {
        *image.get_mut(end)? = NO_TERMS;
        end += 1;
    }
    let payload = &image[HEADER_BYTES..end];
    Some((sequence, crc32(payload), Stored { set: ballbar::wire::decode(payload)?, bytes_crc }))
}

/// Where a slot's renewals are.
fn renewals<F: ParameterFlash>(slot: usize) -> impl Iterator<Item = u32> {
    let fits =
        RENEWAL_BYTES.is_multiple_of(<F as NorFlash>::WRITE_SIZE) && RENEWAL_BYTES.is_multiple_of(<F as ReadNorFlash>::READ_SIZE);
    let room = (F::SLOT_BYTES as usize).saturating_sub(SLOT_IMAGE_BYTES) / RENEWAL_BYTES;
    let count = if fits { room.min(RENEWALS) } else { 0 };
    (0..count).map(move |i| slot as u32 * F::SLOT_BYTES + (SLOT_IMAGE_BYTES + i * RENEWAL_BYTES) as u32)
}

/// A later sequence for the set whose bytes have this CRC-32.
fn renewal(bytes_crc: u32, sequence: u32) -> [u8; RENEWAL_BYTES] {
    let mut bytes = [0xff; RENEWAL_BYTES];
    let mut digest = crc32_digest();
    digest.update(&bytes_crc.to_le_bytes());
    digest.update(&sequence.to_le_bytes());
    bytes[..4].copy_from_slice(&sequence.to_le_bytes());
    bytes[4..8].copy_from_slice(&digest.finalize().to_le_bytes());
    bytes
}

fn read_renewal<F: ParameterFlash>(flash: &mut F, at: u32) -> Result<[u8; RENEWAL_BYTES], CommitError> {
    let mut bytes = [0; RENEWAL_BYTES];
    flash.read(at, &mut bytes).map_err(|_| CommitError::Flash)?;
    Ok(bytes)
}

/// The sequence of the last renewal that is whole.
fn last_renewal<F: ParameterFlash>(flash: &mut F, slot: usize, bytes_crc: u32) -> Result<Option<u32>, CommitError> {
    let mut last = None;
    for at in renewals::<F>(slot) {
        let bytes = read_renewal(flash, at)?;
        let sequence = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        if bytes == renewal(bytes_crc, sequence) {
            last = Some(sequence);
        }
    }
    Ok(last)
}
