//! What is left of a panic or a hard fault: one line in memory that a reset does not clear, and the reset.

#![allow(unsafe_code)] // memory that outlives resets, and a handler that must not trust its stack

use core::mem::MaybeUninit;
use core::panic::PanicInfo;

use ballbar_firmware::CrashRecord;
use cortex_m::peripheral::SCB;
use heapless::String;

#[unsafe(link_section = ".uninit.crash_record")]
static mut RECORD: MaybeUninit<CrashRecord> = MaybeUninit::uninit();

/// The line that the run before this one left, once. To be called before interrupts are let in.
pub(crate) fn take() -> Option<String<96>> {
    // SAFETY: there is no second thread of execution yet.
    unsafe { record() }.take()
}

fn store_and_reset(line: core::fmt::Arguments) -> ! {
    cortex_m::interrupt::disable();
    // SAFETY: with the interrupts off, and no way back, this is the only thread of execution.
    unsafe { record() }.store(line);
    SCB::sys_reset()
}

/// # Safety
/// There must be no other reference to the record.
unsafe fn record() -> &'static mut CrashRecord {
    // SAFETY: the caller's word; and any bits are a `CrashRecord`, whose checksum tells whether they are a true one.
    unsafe { &mut *(&raw mut RECORD).cast() }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    let message = info.message();
    match info.location() {
        // The file without its folders: the record has 96 bytes, and the message comes last.
        Some(place) => {
            let file = place.file().rsplit('/').next().unwrap_or_default();
            store_and_reset(format_args!("{file}:{}: {message}", place.line()))
        }
        None => store_and_reset(format_args!("{message}")),
    }
}

/// The vector of the hard fault. After a stack overflow, which faults because the stack lies at the bottom of its memory, the old
/// stack takes no more: so this reads what it needs and starts on a fresh one before anything is pushed.
///
/// # Safety
/// Only the processor may enter it.
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
#[unsafe(link_section = ".HardFault.user")]
unsafe extern "C" fn hard_fault() -> ! {
    core::arch::naked_asm!(
        "mrs r0, msp",
        "movw r2, #:lower16:_stack_start",
        "movt r2, #:upper16:_stack_start",
        "movs r1, #0", // the address, when the stack holds none
        "movw r3, #:lower16:_stack_end",
        "movt r3, #:upper16:_stack_end",
        "cmp r0, r3",
        "blo 1f",
        "add r3, r0, #32", // what the processor pushes, at least
        "cmp r3, r2",
        "bhi 1f",
        "ldr r1, [r0, #24]", // the program counter among it
        "1:",
        "msr msp, r2",
        "b {report}",
        report = sym report_hard_fault,
    )
}

extern "C" fn report_hard_fault(stack_pointer: u32, program_counter: u32) -> ! {
    if program_counter == 0 {
        store_and_reset(format_args!("hard fault, stack overflow: stack pointer {stack_pointer:#010x}"));
    }
    // SAFETY: reading the fault status changes nothing.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    store_and_reset(format_args!("hard fault at {program_counter:#010x}, CFSR {status:#010x}"))
}
