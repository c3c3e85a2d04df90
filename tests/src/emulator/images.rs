//! The firmware's images, built as they are shipped.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::workspace::target_folder;

/// The boards' target: Cortex-M4F, hard float.
const TARGET: &str = "thumbv7em-none-eabihf";
/// Set by `check` when it could not install the target or QEMU, and said so.
const WITHOUT_BOARD: &str = "BALLBAR_WITHOUT_BOARD";

/// A program for a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Image {
    /// The firmware of the shipped board.
    F405,
    /// The firmware of the emulated board.
    An386,
    /// The counter of instructions.
    An386Counts,
    /// The fit in single precision.
    An386Fit,
}

impl Image {
    /// The image, in ELF. Built when it is asked for first.
    ///
    /// # Panics
    /// When it does not build.
    pub fn elf(self) -> &'static Path {
        static F405: LazyLock<PathBuf> = LazyLock::new(|| build("f405", "f405"));
        static AN386: LazyLock<PathBuf> = LazyLock::new(|| build("an386", "an386"));
        static AN386_COUNTS: LazyLock<PathBuf> = LazyLock::new(|| build("an386-counts", "an386"));
        static AN386_FIT: LazyLock<PathBuf> = LazyLock::new(|| build("an386-fit", "an386"));
        match self {
            Self::F405 => &F405,
            Self::An386 => &AN386,
            Self::An386Counts => &AN386_COUNTS,
            Self::An386Fit => &AN386_FIT,
        }
    }
}

/// Whether tests of images are to be skipped; says so.
pub fn is_skipped() -> bool {
    let is_skipped = std::env::var_os(WITHOUT_BOARD).is_some_and(|value| value == "1");
    if is_skipped {
        eprintln!("SKIPPED, as {WITHOUT_BOARD}=1 asks for: this needs the target {TARGET} and qemu-system-arm");
    }
    is_skipped
}

fn build(bin: &str, feature: &str) -> PathBuf {
    let run = escargot::CargoBuild::new()
        .package("ballbar-firmware")
        .bin(bin)
        .features(feature)
        .release()
        .target(TARGET)
        // A folder of its own: cargo, which runs this test, may hold the lock of the other.
        .target_dir(target_folder().join("board"))
        .arg("--locked")
        .run();
    match run {
        Ok(run) => run.path().to_owned(),
        Err(error) => panic!(
            "the firmware {bin} does not build: {error}\nWhere the target is missing: rustup target add {TARGET}. Where it \
             cannot be had, {WITHOUT_BOARD}=1 skips these tests."
        ),
    }
}
