//! The first instructions after a start: a reset, when it was not one that started the program.
//!
//! The boot loader in ROM jumps (`dfu-util … :leave`): with its own memory at address 0, where the vector table would be looked
//! for, its clocks running, its interrupts let in, its USB on. Start-up code would have to undo all of that without knowing it. A
//! reset does: it samples BOOT0, which is low by then, puts the flash at address 0 and the program at the beginning.
//!
//! It can not go on for ever. A reset with BOOT0 high starts the boot loader and not this program. Whatever else jumps here after
//! every reset is let through the second time, which a mark in memory tells from the first: with the flash put at address 0, and
//! the rest as it was left.

#![allow(unsafe_code)] // runs before memory is set up, hence in assembly

use core::mem::MaybeUninit;

/// SYSCFGEN of it: without its clock, SYSCFG reads as zero.
const RCC_APB2ENR: u32 = 0x4002_3844;
const SYSCFGEN: u32 = 1 << 14;
/// What is seen at address 0: the flash (0), the boot loader's memory (1), or others.
const SYSCFG_MEMRMP: u32 = 0x4001_3800;
const MEM_MODE: u32 = 3;
const SCB_AIRCR: u32 = 0xE000_ED0C;
const VECTKEY_SYSRESETREQ: u32 = 0x05FA_0004;
/// Unlike what memory holds after power-on.
const HAS_RESET: u32 = 0xB0A2_D0F0;

#[unsafe(link_section = ".uninit.boot_mark")]
static MARK: MaybeUninit<u32> = MaybeUninit::uninit();

/// Called by cortex-m-rt's reset handler before memory is set up, when VTOR was set.
///
/// # Safety
/// Only the reset handler may call it.
#[unsafe(naked)]
#[unsafe(export_name = "__pre_init")]
unsafe extern "C" fn reset_after_jump() {
    core::arch::naked_asm!(
        "cpsid i", // whatever was let in; rtic lets the program's own in when it is ready
        "movw r0, #:lower16:{enable}",
        "movt r0, #:upper16:{enable}",
        "ldr r1, [r0]",
        "orr r1, r1, #{syscfgen}",
        "str r1, [r0]",
        "ldr r1, [r0]", // the clock takes two cycles to come
        "dsb",
        "movw r0, #:lower16:{memrmp}",
        "movt r0, #:upper16:{memrmp}",
        "movw r2, #:lower16:{mark}",
        "movt r2, #:upper16:{mark}",
        "movs r3, #0",
        "ldr r1, [r0]",
        "ands r1, r1, #{mem_mode}",
        "beq 2f",
        "movw r1, #:lower16:{has_reset}",
        "movt r1, #:upper16:{has_reset}",
        "ldr r12, [r2]",
        "cmp r12, r1",
        "beq 1f",
        "str r1, [r2]",
        "movw r0, #:lower16:{aircr}",
        "movt r0, #:upper16:{aircr}",
        "movw r1, #:lower16:{sysresetreq}",
        "movt r1, #:upper16:{sysresetreq}",
        "dsb", // the mark has arrived
        "str r1, [r0]",
        "dsb",
        "b .",
        "1:",
        "str r3, [r0]",
        "2:",
        "str r3, [r2]",
        "bx lr",
        enable = const RCC_APB2ENR,
        syscfgen = const SYSCFGEN,
        memrmp = const SYSCFG_MEMRMP,
        mem_mode = const MEM_MODE,
        aircr = const SCB_AIRCR,
        sysresetreq = const VECTKEY_SYSRESETREQ,
        has_reset = const HAS_RESET,
        mark = sym MARK,
    )
}
