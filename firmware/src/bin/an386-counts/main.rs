//! Counts the instructions of the shared crate's hot paths on a Cortex-M4F, and prints the means over many poses.
//!
//! For the emulator with `-icount shift=0`: one instruction is one nanosecond then, and the timer's 25 MHz count forty. A mean over
//! 200 poses is exact to half an instruction; the few of the loop around are in it.
#![no_std]
#![no_main]

mod inputs;
#[path = "../an386/pac.rs"]
#[expect(dead_code, unused_imports, reason = "most of the board's peripherals are not needed here")]
mod pac;

use core::fmt::{self, Write};
use core::hint::black_box;
use core::panic::PanicInfo;

use ballbar::{
    Chain, FreeParameters, JointKind, JointVector, Kinematics, MAX_PARAMETERS, Measurement, NormalEquations, Pairing, Row,
    Vector3,
};
use cortex_m_rt::entry;
use heapless::Vec;

use inputs::{Inputs, MeasuredPose, POSES};
use pac::{FREE_TIMER, LINK_UART};

const INSTRUCTIONS_PER_COUNT: u32 = 1_000_000_000 / pac::CLOCK_HZ;

#[entry]
fn main() -> ! {
    // Too large for the stack.
    static mut MEASUREMENTS: Vec<Measurement<f32>, POSES> = Vec::new();
    static mut NORMAL: Option<NormalEquations<f32>> = None;

    FREE_TIMER.start_free();
    LINK_UART.start(false);
    let inputs = inputs();
    MEASUREMENTS.extend(inputs.poses.iter().map(measurement));
    let chain = Chain::new(&[JointKind::Revolute; 6], &inputs.parameters);
    let free = FreeParameters::from_indices(inputs.free.iter().map(|&index| index as usize));
    match (chain, free) {
        (Ok(chain), Ok(free)) => count(&Kinematics::new(&chain), MEASUREMENTS, NORMAL.insert(NormalEquations::new(free))),
        _ => say(format_args!("the inputs are no robot of six joints")),
    }
    say(format_args!("end"));
    loop {
        cortex_m::asm::wfi();
    }
}

fn count(kinematics: &Kinematics<f32>, measurements: &[Measurement<f32>], normal: &mut NormalEquations<f32>) {
    let mut row: Row<f32> = [0.0; MAX_PARAMETERS];
    let forward_kinematics = total(measurements, |measurement| {
        black_box(kinematics.base_from_tool(black_box(&measurement.q)));
    });
    let gradient_row = total(measurements, |measurement| {
        black_box(residual_row(kinematics, measurement, &mut row));
    });
    let row_and_update = total(measurements, |measurement| {
        let residual_m = residual_row(kinematics, measurement, &mut row);
        normal.add(black_box(&row), black_box(residual_m), black_box(measurement.weight));
    });
    for (name, counts) in [
        ("forward kinematics", forward_kinematics),
        ("gradient row", gradient_row),
        ("update of 36 columns", row_and_update - gradient_row),
    ] {
        let tenths = tenths(counts);
        say(format_args!("{name}: {}.{}", tenths / 10, tenths % 10));
    }
}

/// Not inlined, so that it is the same code in both loops, of which the one is subtracted from the other.
#[inline(never)]
fn residual_row(kinematics: &Kinematics<f32>, measurement: &Measurement<f32>, row: &mut Row<f32>) -> f32 {
    kinematics.residual_row(measurement, row)
}

/// The timer's counts for doing this work at every pose.
fn total(measurements: &[Measurement<f32>], mut work: impl FnMut(&Measurement<f32>)) -> u32 {
    let began = FREE_TIMER.elapsed();
    for measurement in measurements {
        work(measurement);
    }
    FREE_TIMER.elapsed().wrapping_sub(began)
}

/// Tenths of instructions a pose, of the timer's counts for all.
fn tenths(counts: u32) -> u32 {
    counts * INSTRUCTIONS_PER_COUNT * 10 / POSES as u32
}

fn measurement(pose: &MeasuredPose) -> Measurement<f32> {
    let mut q = JointVector::zero();
    q.as_array_mut()[..pose.q_rad.len()].copy_from_slice(&pose.q_rad);
    let pairing = Pairing { chuck_base_m: Vector3::from(pose.chuck_base_m), sphere_tool_m: Vector3::from(pose.sphere_tool_m) };
    Measurement { pairing, q, length_m: pose.length_m, weight: 1.0 }
}

fn inputs() -> &'static Inputs {
    const PSRAM: usize = 0x2100_0000;
    // SAFETY: memory of the board that the linker uses for nothing, and any bits in it are numbers.
    #[expect(unsafe_code, reason = "the loader's memory is known to nobody but it and this")]
    unsafe {
        &*(PSRAM as *const Inputs)
    }
}

struct Printer;

impl Write for Printer {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(|byte| LINK_UART.write(byte));
        Ok(())
    }
}

fn say(line: fmt::Arguments<'_>) {
    let _ = writeln!(Printer, "{line}");
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    say(format_args!("{info}\nend"));
    loop {
        cortex_m::asm::wfi();
    }
}
