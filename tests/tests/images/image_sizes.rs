//! What the firmware's images take of flash and memory.
#![cfg(unix)]

use ballbar_tests::emulator::{Image, is_skipped};
use object::read::elf::ElfFile32;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, elf};

const KIB: u64 = 1024;
const FLASH_LIMIT: u64 = 128 * KIB;
const RAM_LIMIT: u64 = 48 * KIB;

#[test]
fn images_stay_within_their_limits() {
    if is_skipped() {
        return;
    }
    let mut rounded = String::new();
    for (name, image) in [("f405", Image::F405), ("an386", Image::An386)] {
        let bytes = std::fs::read(image.elf()).unwrap();
        let Sizes { flash, ram, stack } = Sizes::of(&ElfFile32::parse(&*bytes).unwrap());
        assert!(flash <= FLASH_LIMIT, "{name}: {flash} bytes of flash, of {FLASH_LIMIT} allowed");
        assert!(ram <= RAM_LIMIT, "{name}: {ram} bytes of memory, of {RAM_LIMIT} allowed");
        let kib = |bytes: u64| bytes.div_ceil(KIB);
        rounded += &format!("{name}: {} KiB of flash, {} KiB of RAM, {} of them stack\n", kib(flash), kib(ram), kib(stack));
    }
    // A compiler of another version may well change these: accept with `cargo insta review`.
    insta::assert_snapshot!(rounded, @r"
    f405: 127 KiB of flash, 47 KiB of RAM, 24 of them stack
    an386: 120 KiB of flash, 43 KiB of RAM, 24 of them stack
    ");
}

/// Bytes of an image.
struct Sizes {
    /// What is written into flash, the first values of variables included.
    flash: u64,
    /// Variables and the stack.
    ram: u64,
    /// The stack.
    stack: u64,
}

impl Sizes {
    fn of(file: &ElfFile32<'_>) -> Self {
        let symbol = |name: &str| {
            let found = file.symbols().find(|symbol| symbol.name() == Ok(name));
            found.unwrap_or_else(|| panic!("no symbol {name}")).address()
        };
        let stack = symbol("_stack_start") - symbol("_stack_end");
        let mut sizes = Self { flash: 0, ram: stack, stack };
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(elf::SHF_ALLOC) == 0 {
                continue;
            }
            let is_written = section.elf_section_header().sh_type.get(file.endian()) == elf::SHT_PROGBITS;
            if is_written {
                sizes.flash += section.size();
            }
            if sh_flags & u64::from(elf::SHF_WRITE) != 0 {
                sizes.ram += section.size();
            }
        }
        sizes
    }
}
