//! Parameters in flash survive a power cut at any byte, any one flipped bit, and a flash that fails.

use ballbar::wire::{ParameterSet, SlotState};
use ballbar_firmware::{CommitError, MemoryFlash, ParameterFlash, Slots};
use ballbar_tests::parameter_sets::{calibrated_puma, largest, puma, two_joints};
use ballbar_tests::power_cut::{Debris, MockFlash, Trouble};

/// Of different lengths, so that a mixture of two is longer or shorter than either.
fn sets() -> [ParameterSet; 5] {
    [puma(), two_joints(), largest(), calibrated_puma(), puma()]
}

/// Flash after the first `commits` of the sets.
fn flash_after<const WORD: usize>(commits: usize) -> MockFlash<WORD> {
    let mut flash = MockFlash::new(commits as u64);
    for set in &sets()[..commits] {
        Slots::load(&mut flash).0.commit(&mut flash, set).unwrap();
    }
    flash
}

fn stored(flash: &mut impl ParameterFlash) -> Option<ParameterSet> {
    Slots::load(flash).1
}

/// Cuts the power at every byte of the commit that follows `commits` others, and looks at what is left.
fn cut_everywhere<const WORD: usize>(commits: usize) {
    let before = flash_after::<WORD>(commits);
    let old = commits.checked_sub(1).map(|last| sets()[last].clone());
    let (new, later) = (&sets()[commits], &sets()[(commits + 1) % 5]);
    let mut whole = before.clone();
    Slots::load(&mut whole).0.commit(&mut whole, new).unwrap();
    let bytes_changed = whole.bytes_changed - before.bytes_changed;
    assert!(bytes_changed > 1_000);

    for debris in Debris::ALL {
        let (mut old_found, mut new_found) = (0, 0);
        for bytes in 0..bytes_changed {
            let mut flash = before.clone();
            flash.trouble = Trouble::CutAfter { bytes, debris };
            let outcome = Slots::load(&mut flash).0.commit(&mut flash, new);
            flash.trouble = Trouble::None;

            let found = stored(&mut flash);
            let is_new = found.as_ref() == Some(new);
            assert_eq!(outcome.is_ok(), is_new, "cut after {bytes} bytes and did not say what is stored");
            assert!(is_new || found == old, "commit {commits} cut after {bytes} bytes ({debris:?}) left {found:?}");
            *(if is_new { &mut new_found } else { &mut old_found }) += 1;

            Slots::load(&mut flash)
                .0
                .commit(&mut flash, later)
                .unwrap_or_else(|error| panic!("no commit after the cut: {error:?}"));
            assert_eq!(stored(&mut flash).as_ref(), Some(later), "the commit after a cut after {bytes} bytes is not in use");
        }
        assert!(old_found > 500, "{debris:?}: {old_found} old, {new_found} new");
        // The first commit writes the set twice: cut in the second half, it has stored the set already.
        assert_eq!(new_found > 500, commits == 0, "{debris:?}: {old_found} old, {new_found} new");
    }
}

#[test]
fn a_power_cut_at_any_byte_leaves_the_old_set_or_the_new_one_with_words_of_1_byte() {
    (0..4).for_each(cut_everywhere::<1>);
}

#[test]
fn a_power_cut_at_any_byte_leaves_the_old_set_or_the_new_one_with_words_of_4_bytes() {
    (0..4).for_each(cut_everywhere::<4>);
}

#[test]
fn a_power_cut_at_any_byte_leaves_the_old_set_or_the_new_one_with_words_of_8_bytes() {
    (0..4).for_each(cut_everywhere::<8>);
}

/// The next commit is cut as well, and the one after it.
#[test]
fn cuts_in_a_row_never_lose_the_set_that_was_committed_last() {
    for bytes in (0..2_100).step_by(11) {
        let mut flash = flash_after::<4>(3);
        for i in 0..4 {
            flash.trouble = Trouble::CutAfter { bytes: (bytes + 311 * i) % 2_100, debris: Debris::Random };
            let is_committed = Slots::load(&mut flash).0.commit(&mut flash, &sets()[3]).is_ok();
            flash.trouble = Trouble::None;
            assert_eq!(stored(&mut flash).as_ref(), Some(&sets()[if is_committed { 3 } else { 2 }]), "{bytes}");
            if is_committed {
                break;
            }
        }
    }
}

#[test]
fn any_one_flipped_bit_leaves_the_set_in_use_or_the_one_before() {
    for commits in 1..=4 {
        let whole = flash_after::<4>(commits);
        let (new, old) = (&sets()[commits - 1], &sets()[commits.saturating_sub(2)]);
        let mut falls_back = 0;
        for bit in 0..8 * MockFlash::<4>::BYTES {
            let mut flash = whole.clone();
            flash.memory[bit / 8] ^= 1 << (bit % 8);
            let found =
                stored(&mut flash).unwrap_or_else(|| panic!("commit {commits}: nothing is left after a flip of bit {bit}"));
            assert!(found == *new || found == *old, "commit {commits}, bit {bit}: {found:?}");
            falls_back += u32::from(found != *new);
        }
        // After the first commit both slots hold the same.
        assert_eq!(falls_back > 1_000, commits > 1, "commit {commits}: {falls_back}");
    }
}

#[test]
fn a_commit_that_the_flash_refuses_leaves_the_old_set_in_use() {
    let words = (0..300).map(|words| Trouble::Write { words });
    for trouble in [Trouble::Erase, Trouble::StuckBit].into_iter().chain(words) {
        for commits in 1..4 {
            let mut flash = flash_after::<4>(commits);
            let (mut slots, old) = (Slots::load(&mut flash).0, sets()[commits - 1].clone());
            let active = slots.active();
            flash.trouble = trouble;
            let outcome = slots.commit(&mut flash, &sets()[commits]);
            flash.trouble = Trouble::None;
            let set_words = postcard::to_stdvec(&sets()[commits]).unwrap().len().div_ceil(4);
            if matches!(trouble, Trouble::Write { words } if words >= set_words) {
                assert_eq!(outcome, Ok(()), "the flash took all of it");
                continue;
            }
            let expected = if trouble == Trouble::StuckBit { CommitError::ReadBack } else { CommitError::Flash };
            assert_eq!(outcome, Err(expected), "{trouble:?}");
            assert_eq!(slots.active(), active);
            assert_eq!(stored(&mut flash), Some(old), "{trouble:?} at commit {commits}");
            assert_eq!(slots.commit(&mut flash, &sets()[commits]), Ok(()), "the flash recovered, and still no commit");
            assert_eq!(stored(&mut flash).as_ref(), Some(&sets()[commits]));
        }
    }
}

#[test]
fn a_commit_to_a_flash_that_cannot_be_read_leaves_the_old_set() {
    for commits in 1..4 {
        let mut flash = flash_after::<4>(commits);
        let mut slots = Slots::load(&mut flash).0;
        flash.trouble = Trouble::Read;
        assert!(slots.commit(&mut flash, &sets()[commits]).is_err());
        flash.trouble = Trouble::None;
        assert_eq!(stored(&mut flash).as_ref(), Some(&sets()[commits - 1]), "commit {commits}");
    }
}

/// The first commit writes both slots; the set is stored when the first of them is.
#[test]
fn a_first_commit_whose_second_slot_fails_is_a_commit_without_its_copy() {
    let mut flash = MockFlash::<4>::new(0);
    flash.trouble = Trouble::CutAfter { bytes: 2_800, debris: Debris::Mixture };
    let (mut slots, _) = Slots::load(&mut flash);
    assert_eq!(slots.commit(&mut flash, &puma()), Ok(()));
    assert!(matches!(slots.states(), [SlotState::Good { .. }, SlotState::Damaged]));
    flash.trouble = Trouble::None;
    assert_eq!(stored(&mut flash), Some(puma()));
}

/// What was read at the start is no longer true: to erase the older slot now would leave nothing.
#[test]
fn a_slot_that_rotted_since_the_start_is_the_one_that_is_written() {
    let mut whole = flash_after::<4>(2);
    let mut slots = Slots::load(&mut whole).0;
    whole.memory[MockFlash::<4>::SLOT_BYTES as usize + 50] ^= 4;
    let old = sets()[0].clone();
    assert_eq!(stored(&mut whole).as_ref(), Some(&old));
    for bytes in 0..1_500 {
        let mut flash = whole.clone();
        flash.trouble = Trouble::CutAfter { bytes, debris: Debris::Random };
        assert!(slots.commit(&mut flash, &largest()).is_err());
        flash.trouble = Trouble::None;
        assert_eq!(stored(&mut flash).as_ref(), Some(&old), "cut after {bytes} bytes");
    }
}

#[test]
fn the_sequence_wraps_and_the_newer_set_stays_the_newer() {
    let mut flash = flash_after::<4>(2);
    // As after four thousand million commits: the sequence is set, and the CRC over it.
    for (slot, sequence) in [(0, u32::MAX - 1), (1, u32::MAX)] {
        set_sequence(&mut flash, slot, sequence);
    }
    assert_eq!(Slots::load(&mut flash).0.active().map(|(sequence, _)| sequence), Some(u32::MAX));
    for (set, sequence) in [(largest(), 0), (puma(), 1), (calibrated_puma(), 2)] {
        Slots::load(&mut flash).0.commit(&mut flash, &set).unwrap();
        let (slots, found) = Slots::load(&mut flash);
        assert_eq!((slots.active().map(|(sequence, _)| sequence), found), (Some(sequence), Some(set)));
    }
}

/// Writes another sequence into a slot's header, as the table in `firmware/src/slots.rs` has it.
fn set_sequence(flash: &mut MockFlash<4>, slot: usize, sequence: u32) {
    let image = &mut flash.memory[slot * MockFlash::<4>::SLOT_BYTES as usize..];
    let length = u32::from_le_bytes(image[12..16].try_into().unwrap()) as usize;
    image[8..12].copy_from_slice(&sequence.to_le_bytes());
    let crc = ballbar::crc32(&[&image[..16], &image[20..20 + length]].concat());
    image[16..20].copy_from_slice(&crc.to_le_bytes());
}

/// Flash with the second set in use and the first in the other slot.
fn flash_with_a_previous<const WORD: usize>() -> MockFlash<WORD> {
    let flash = flash_after::<WORD>(2);
    assert_eq!(previous(&mut flash.clone()), Some(puma()));
    flash
}

fn previous(flash: &mut impl ParameterFlash) -> Option<ParameterSet> {
    Slots::load(flash).0.read_previous(flash).map(|(_, _, set)| set)
}

/// Stores what was in use before.
fn go_back(flash: &mut impl ParameterFlash) -> Result<(), CommitError> {
    let set = previous(flash).expect("nothing was in use before");
    Slots::load(flash).0.commit(flash, &set)
}

#[test]
fn the_set_before_comes_back_and_the_two_change_places_every_time() {
    let mut flash = flash_with_a_previous::<4>();
    // More often than there is room for renewals: the slots are then written anew.
    for i in 0..80 {
        let (back, away) = if i % 2 == 0 { (puma(), two_joints()) } else { (two_joints(), puma()) };
        assert_eq!(go_back(&mut flash), Ok(()));
        assert_eq!((stored(&mut flash), previous(&mut flash)), (Some(back), Some(away)), "{i}");
        assert_eq!(Slots::load(&mut flash).0.active().map(|(sequence, _)| sequence), Some(2 + i));
    }
    Slots::load(&mut flash).0.commit(&mut flash, &largest()).unwrap();
    assert_eq!((stored(&mut flash), previous(&mut flash)), (Some(largest()), Some(two_joints())));
}

/// Neither set is lost, whichever byte the power fails at, and after that it goes on as if nothing had been.
fn cut_everywhere_on_the_way_back<const WORD: usize>() {
    let before = flash_with_a_previous::<WORD>();
    let mut whole = before.clone();
    go_back(&mut whole).unwrap();
    let bytes_changed = whole.bytes_changed - before.bytes_changed;
    assert_eq!(bytes_changed, 32, "nothing is to be erased");
    for debris in Debris::ALL {
        for bytes in 0..bytes_changed {
            let mut flash = before.clone();
            flash.trouble = Trouble::CutAfter { bytes, debris };
            let outcome = go_back(&mut flash);
            flash.trouble = Trouble::None;
            let (now, other) = (stored(&mut flash), previous(&mut flash));
            let sets = if now == Some(puma()) { (puma(), two_joints()) } else { (two_joints(), puma()) };
            assert_eq!((now, other), (Some(sets.0), Some(sets.1)), "cut after {bytes} bytes ({debris:?})");
            assert!(outcome.is_err() || stored(&mut flash) == Some(puma()));
            let then = previous(&mut flash);
            go_back(&mut flash).unwrap_or_else(|error| panic!("no way back after a cut after {bytes} bytes: {error:?}"));
            assert_eq!(stored(&mut flash), then);
        }
    }
}

#[test]
fn a_power_cut_at_any_byte_of_the_way_back_leaves_both_sets() {
    cut_everywhere_on_the_way_back::<1>();
    cut_everywhere_on_the_way_back::<4>();
    cut_everywhere_on_the_way_back::<8>();
    cut_everywhere_on_the_way_back::<32>();
}

/// When all room for renewals is used, the slot is written anew: one of the two sets is whole at any byte.
#[test]
fn a_power_cut_at_any_byte_of_a_way_back_without_room_leaves_the_set_in_use() {
    let mut before = flash_with_a_previous::<4>();
    let mut next = before.clone();
    go_back(&mut next).unwrap();
    while next.bytes_changed - before.bytes_changed < 1_000 {
        before = next.clone();
        go_back(&mut next).unwrap();
    }
    let old = stored(&mut before);
    let mut whole = before.clone();
    go_back(&mut whole).unwrap();
    let bytes_changed = whole.bytes_changed - before.bytes_changed;
    assert!(bytes_changed > 1_500, "{bytes_changed}");
    for bytes in 0..bytes_changed {
        let mut flash = before.clone();
        flash.trouble = Trouble::CutAfter { bytes, debris: Debris::Random };
        assert!(go_back(&mut flash).is_err());
        flash.trouble = Trouble::None;
        assert_eq!(stored(&mut flash), old, "cut after {bytes} bytes");
    }
}

#[test]
fn the_only_set_that_there_ever_was_has_none_before_it() {
    assert_eq!(previous(&mut MockFlash::<4>::new(0)), None);
    assert_eq!(previous(&mut flash_after::<4>(1)), None);
}

/// Whoever uploads the same file twice does not lose the set before it.
#[test]
fn a_commit_of_the_set_in_use_writes_nothing() {
    let mut flash = flash_with_a_previous::<4>();
    let bytes_changed = flash.bytes_changed;
    Slots::load(&mut flash).0.commit(&mut flash, &two_joints()).unwrap();
    assert_eq!((flash.bytes_changed, previous(&mut flash)), (bytes_changed, Some(puma())));
}

#[test]
fn a_way_back_that_the_flash_refuses_costs_neither_set() {
    for trouble in [Trouble::Write { words: 0 }, Trouble::Write { words: 1 }, Trouble::StuckBit] {
        let mut flash = flash_with_a_previous::<4>();
        let mut slots = Slots::load(&mut flash).0;
        flash.trouble = trouble;
        assert!(slots.commit(&mut flash, &puma()).is_err());
        flash.trouble = Trouble::None;
        assert_eq!((stored(&mut flash), previous(&mut flash)), (Some(two_joints()), Some(puma())), "{trouble:?}");
        assert_eq!(slots.commit(&mut flash, &puma()), Ok(()), "the flash recovered, and still no way back");
        assert_eq!((stored(&mut flash), previous(&mut flash)), (Some(puma()), Some(two_joints())));
    }
}

/// All that matters was written before the flash failed: refused, it would be in use after the next start all the same.
#[test]
fn a_way_back_that_reads_back_counts_whatever_the_flash_says() {
    let mut flash = flash_with_a_previous::<4>();
    flash.trouble = Trouble::Write { words: 3 };
    assert_eq!(go_back(&mut flash), Ok(()));
    flash.trouble = Trouble::None;
    assert_eq!((stored(&mut flash), previous(&mut flash)), (Some(puma()), Some(two_joints())));
}

#[test]
fn any_one_flipped_bit_after_a_way_back_leaves_one_of_the_two_sets() {
    let mut whole = flash_with_a_previous::<4>();
    go_back(&mut whole).unwrap();
    for bit in 0..8 * MockFlash::<4>::BYTES {
        let mut flash = whole.clone();
        flash.memory[bit / 8] ^= 1 << (bit % 8);
        let found = stored(&mut flash).unwrap_or_else(|| panic!("nothing is left after a flip of bit {bit}"));
        assert!(found == puma() || found == two_joints(), "bit {bit}: {found:?}");
    }
}

#[test]
fn a_slot_without_room_for_renewals_is_written_anew() {
    // As flash of the firmware before was: what it wrote is read, and its slot has no renewals.
    let mut flash = MemoryFlash::new([0xff; 4096]);
    for set in [puma(), two_joints()] {
        Slots::load(&mut flash).0.commit(&mut flash, &set).unwrap();
    }
    let mut memory = *flash.memory();
    memory[1024..2048].fill(0);
    memory[3072..].fill(0);
    let mut flash = MemoryFlash::new(memory);
    assert_eq!((stored(&mut flash), previous(&mut flash)), (Some(two_joints()), Some(puma())));
    go_back(&mut flash).unwrap();
    assert_eq!((stored(&mut flash), previous(&mut flash)), (Some(puma()), Some(two_joints())));
}

#[test]
fn erased_flash_is_empty_and_flash_of_something_else_is_damaged() {
    assert_eq!(Slots::load(&mut MockFlash::<4>::new(0)).0.states(), [SlotState::Empty; 2]);
    for byte in [0, 0x42, 0xfe] {
        let mut flash = MockFlash::<4>::new(0);
        flash.memory.fill(byte);
        let (slots, set) = Slots::load(&mut flash);
        assert_eq!((slots.states(), set), ([SlotState::Damaged; 2], None));
    }
}

#[test]
fn flash_that_cannot_be_read_holds_nothing() {
    let mut flash = flash_after::<4>(2);
    flash.trouble = Trouble::Read;
    let (slots, set) = Slots::load(&mut flash);
    assert_eq!((slots.active(), set), (None, None));
}

#[test]
fn a_length_beyond_the_slot_is_damage() {
    for length in [1_005, 1_024, 60_000, u32::MAX - 19, u32::MAX] {
        let mut flash = flash_after::<4>(1);
        flash.memory[12..16].copy_from_slice(&length.to_le_bytes());
        assert_eq!(Slots::load(&mut flash).0.states()[0], SlotState::Damaged, "{length}");
    }
}

#[test]
fn flash_of_memory_keeps_sets_as_flash_does() {
    let mut flash = MemoryFlash::new([0xff; 4096]);
    for set in sets() {
        Slots::load(&mut flash).0.commit(&mut flash, &set).unwrap();
        assert_eq!(stored(&mut flash), Some(set));
    }
}
