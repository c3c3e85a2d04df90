//! The stack: how much of it was never used, and that its end is an end.

#![allow(unsafe_code)] // the linker's bounds of the stack, and the memory between them

use core::ops::Range;
use core::ptr;

use cortex_m::peripheral::MPU;

/// log2 of the bytes below the stack that nothing may touch: more than any frame of a function.
const GUARD_LOG2: u32 = 16;

/// Has the memory protection unit refuse what lies below the stack: the emulated bus takes writes there without a fault.
pub(crate) fn guard(mpu: &MPU) {
    const ENABLE: u32 = 1;
    const NEVER_EXECUTE: u32 = 1 << 28;
    const OTHERS_AS_WITHOUT: u32 = 1 << 2;
    let base = addresses().start as u32 - (1 << GUARD_LOG2);
    // SAFETY: one region, without any access, over addresses that nothing uses; the rest stays as it was.
    unsafe {
        mpu.rnr.write(0);
        mpu.rbar.write(base);
        mpu.rasr.write(NEVER_EXECUTE | ((GUARD_LOG2 - 1) << 1) | ENABLE);
        mpu.ctrl.write(OTHERS_AS_WITHOUT | ENABLE);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// Bytes that were never used since start.
pub(crate) fn unused_bytes() -> u32 {
    const WORD_BYTES: usize = 4;
    let words = addresses().step_by(WORD_BYTES);
    // SAFETY: aligned words of the stack's own memory, which the start-up code painted.
    let untouched = words.take_while(|&word| unsafe { ptr::read_volatile(word as *const u32) } == cortex_m_rt::STACK_PAINT_VALUE);
    (untouched.count() * WORD_BYTES) as u32
}

fn addresses() -> Range<usize> {
    unsafe extern "C" {
        static _stack_start: u32;
        static _stack_end: u32;
    }
    // "Start" is where the stack starts, at the top.
    ptr::addr_of!(_stack_end) as usize..ptr::addr_of!(_stack_start) as usize
}
