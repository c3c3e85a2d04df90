//! Counts the instructions of the shared crate's hot paths on a Cortex-M4F, and prints the means over many poses.
//!
//! For the emulator with `-icount shift=0`: one instruction is one nanosecond then, and the timer's 25 MHz count forty. A mean over
//! 200 poses is exact to half an instruction; the few of the loop around are in it.
#![no_std]
#![no_main]

#[path = "../common/loaded.rs"]
mod loaded;
#[path = "../an386/pac.rs"]
#[expect(dead_code, unused_imports, reason = "most of the board's peripherals are not needed here")]
mod pac;

use core::hint::black_box;

use ballbar::{
    Chain, JointKind, Kinematics, LANES, Lanes, LengthRows, MAX_PARAMETERS, Measurement, NormalEquations, Quantity, Row,
};
use cortex_m_rt::entry;
use heapless::Vec;

use loaded::{FREE, INSTRUCTIONS_PER_COUNT, end, inputs, say, start};
use pac::FREE_TIMER;

/// Poses that are computed.
const POSES: usize = 200;

#[entry]
fn main() -> ! {
    // Too large for the stack.
    static mut MEASUREMENTS: Vec<Measurement<f32>, POSES> = Vec::new();
    static mut MEMORY: [f32; NormalEquations::<f32>::memory(FREE)] = [0.0; NormalEquations::<f32>::memory(FREE)];

    start();
    let inputs = inputs();
    MEASUREMENTS.extend(inputs.measurements().take(POSES));
    let chain = Chain::new(&[JointKind::Revolute; 6], &inputs.parameters);
    match (chain, NormalEquations::new(FREE, MEMORY)) {
        (Ok(chain), Ok(mut normal)) => count(&Kinematics::new(&chain), MEASUREMENTS, &inputs.free, &mut normal),
        _ => say(format_args!("the inputs are no robot of six joints")),
    }
    end()
}

fn count(kinematics: &Kinematics<f32>, measurements: &[Measurement<f32>], free: &[u32], normal: &mut NormalEquations<'_, f32>) {
    let mut row: Row<f32> = [0.0; MAX_PARAMETERS];
    let forward_kinematics = total(measurements.iter(), |measurement| {
        black_box(kinematics.base_from_tool(black_box(&measurement.q)));
    });
    let gradient_row = total(measurements.iter(), |measurement| {
        black_box(gradient_row(kinematics, measurement, &mut row));
    });
    let mut rows = LengthRows::default();
    let block_of_rows = total(measurements.chunks(LANES), |block| rows.compute(kinematics, black_box(block)));
    let mut columns = [[0.0; LANES]; FREE];
    for (column, &index) in columns.iter_mut().zip(free) {
        *column = *rows.chain(index as usize);
    }
    let update = total(measurements.chunks(LANES), |_| normal.add(&rows.over(black_box::<&[Lanes<f32>]>(&columns))));
    for (name, counts) in [
        ("forward kinematics", forward_kinematics),
        ("gradient row", gradient_row),
        ("row in a block of eight", block_of_rows),
        ("update of 36 columns in a block of eight", update),
    ] {
        let tenths = tenths(counts);
        say(format_args!("{name}: {}.{}", tenths / 10, tenths % 10));
    }
}

/// Not inlined, so that what it writes is written.
#[inline(never)]
fn gradient_row(kinematics: &Kinematics<f32>, measurement: &Measurement<f32>, row: &mut Row<f32>) -> f32 {
    measurement.length_m - kinematics.gradient(Quantity::Length, &measurement.q, &measurement.pairing, row).value_m
}

/// The timer's counts for doing this work with every item.
fn total<T>(items: impl Iterator<Item = T>, mut work: impl FnMut(T)) -> u32 {
    let began = FREE_TIMER.elapsed();
    for item in items {
        work(item);
    }
    FREE_TIMER.elapsed().wrapping_sub(began)
}

/// Tenths of instructions a pose, of the timer's counts for all.
fn tenths(counts: u32) -> u32 {
    counts * INSTRUCTIONS_PER_COUNT * 10 / POSES as u32
}
