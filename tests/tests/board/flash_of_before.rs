//! Flash as the firmware before joint terms left it is read, kept and gone back to.
//!
//! The images are what that firmware (protocol 2, slots of 2,048 bytes) wrote itself: `flash_of_protocol_2.bin` after the commits of
//! `puma()`, of `calibrated_puma()`, and of what was in use before; `flash_of_protocol_2_largest.bin` after those of `largest()`, which
//! had no terms then, and of `two_joints()`.

use ballbar::wire::{Answer, Command, ParameterSet, SlotState, WhichSet};
use ballbar_firmware::{MemoryFlash, ParameterFlash, Slots};
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::parameter_sets::{calibrated_puma, largest, puma, puma_with_terms, two_joints};
use ballbar_tests::power_cut::{Debris, MockFlash, Trouble};

const FLASH: &[u8; 4096] = include_bytes!("../../golden/flash_of_protocol_2.bin");
const LARGEST: &[u8; 4096] = include_bytes!("../../golden/flash_of_protocol_2_largest.bin");

fn largest_without_terms() -> ParameterSet {
    ParameterSet { terms: heapless::Vec::new(), ..largest() }
}

/// The same image in a flash whose power can be cut.
fn mock<const WORD: usize>() -> MockFlash<WORD> {
    const SLOT: usize = 2048;
    let mut flash = MockFlash::<WORD>::new(1);
    let slots = flash.memory.len() / 2;
    for slot in 0..2 {
        // Header, set and renewals.
        let image = &FLASH[slot * SLOT..][..1024 + 512];
        flash.memory[slot * slots..][..image.len()].copy_from_slice(image);
    }
    flash
}

fn stored(flash: &mut impl ParameterFlash) -> Option<ParameterSet> {
    Slots::load(flash).1
}

fn previous(flash: &mut impl ParameterFlash) -> Option<ParameterSet> {
    Slots::load(flash).0.read_previous(flash).map(|(_, _, set)| set)
}

#[test]
fn both_sets_are_there_and_known_by_the_crc_that_a_host_commits_with() {
    for (image, sequences, now, before) in
        [(FLASH, (2, 1), puma(), calibrated_puma()), (LARGEST, (1, 0), two_joints(), largest_without_terms())]
    {
        let mut flash = MemoryFlash::new(*image);
        let (slots, found) = Slots::load(&mut flash);
        let crc = |set: &ParameterSet| ballbar::crc32(&postcard::to_stdvec(set).unwrap());
        assert_eq!((slots.active(), found.as_ref()), (Some((sequences.0, crc(&now))), Some(&now)));
        assert_eq!(slots.read_previous(&mut flash), Some((sequences.1, crc(&before), before)));
        assert!(slots.states().iter().all(|state| matches!(state, SlotState::Good { .. })));
    }
}

#[test]
fn a_board_uses_it_as_its_own() {
    let mut board = FakeBoard::on(MemoryFlash::new(FLASH.to_vec().into_boxed_slice())).settle_in();
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(puma())));
    assert_eq!(board.ask(Command::ReadPrevious), Ok(Answer::Parameters(calibrated_puma())));
    let Ok(Answer::SelfTest(test)) = board.ask(Command::SelfTest) else { panic!("no self-test") };
    assert!(test.results.iter().all(|result| result.passed), "{test:?}");
    // Nothing to store, and so nothing written.
    assert_eq!(board.commit(&puma()), Ok(Answer::Done));
    assert_eq!(board.machine().flash.memory()[..], FLASH[..]);
}

#[test]
fn the_set_before_comes_back_without_an_erase_and_with_it_the_firmware_before() {
    let mut flash = mock::<4>();
    for (back, away) in [(calibrated_puma(), puma()), (puma(), calibrated_puma())] {
        let bytes_changed = flash.bytes_changed;
        Slots::load(&mut flash).0.commit(&mut flash, &back).unwrap();
        assert_eq!(flash.bytes_changed - bytes_changed, 32);
        assert_eq!((stored(&mut flash), previous(&mut flash)), (Some(back), Some(away)));
    }
    // A renewal as the firmware before writes it: a sequence, and a CRC over it behind the CRC of the set's bytes.
    let length = u32::from_le_bytes(FLASH[12..16].try_into().unwrap()) as usize;
    let bytes_crc = ballbar::crc32(&FLASH[20..20 + length]);
    let renewed = &flash.memory[1024 + 32..][..8];
    assert_eq!(renewed[..4], 4_u32.to_le_bytes());
    assert_eq!(renewed[4..], ballbar::crc32(&[bytes_crc.to_le_bytes(), 4_u32.to_le_bytes()].concat()).to_le_bytes());
}

/// Of the two old slots the older is written anew, and the newer stays until then.
#[test]
fn a_power_cut_at_any_byte_of_a_commit_leaves_the_old_set_or_the_new_one() {
    let before = mock::<4>();
    let mut whole = before.clone();
    Slots::load(&mut whole).0.commit(&mut whole, &puma_with_terms()).unwrap();
    assert_eq!((stored(&mut whole), previous(&mut whole)), (Some(puma_with_terms()), Some(puma())));
    let bytes_changed = whole.bytes_changed - before.bytes_changed;
    assert!(bytes_changed > 1_000);
    for debris in Debris::ALL {
        for bytes in 0..bytes_changed {
            let mut flash = before.clone();
            flash.trouble = Trouble::CutAfter { bytes, debris };
            assert!(Slots::load(&mut flash).0.commit(&mut flash, &puma_with_terms()).is_err());
            flash.trouble = Trouble::None;
            assert_eq!(stored(&mut flash), Some(puma()), "cut after {bytes} bytes ({debris:?})");
        }
    }
}

#[test]
fn any_one_flipped_bit_leaves_one_of_the_two_sets() {
    for bit in 0..8 * FLASH.len() {
        let mut memory = *FLASH;
        memory[bit / 8] ^= 1 << (bit % 8);
        let found = stored(&mut MemoryFlash::new(memory));
        assert!(found == Some(puma()) || found == Some(calibrated_puma()), "bit {bit}: {found:?}");
    }
}
