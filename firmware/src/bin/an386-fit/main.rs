//! Fits a robot on the emulated board, in single precision: the same Levenberg-Marquardt as the host's, in memory as the shipped board
//! has it. Prints how it ended, the steps, the instructions (in thousands, `-icount shift=0`) and the bits of every parameter.
#![no_std]
#![no_main]

#[path = "../common/loaded.rs"]
mod loaded;
#[path = "../an386/pac.rs"]
#[expect(dead_code, unused_imports, reason = "most of the board's peripherals are not needed here")]
mod pac;

use ballbar::{Chain, Damping, FreeParameters, JointKind, Lengths, LmOptions, lm_memory, minimise};
use cortex_m_rt::entry;

use loaded::{FREE, INSTRUCTIONS_PER_COUNT, end, inputs, say, start};
use pac::FREE_TIMER;

#[entry]
fn main() -> ! {
    // Too large for the stack.
    static mut MEMORY: [f32; lm_memory::<f32>(FREE)] = [0.0; lm_memory::<f32>(FREE)];

    start();
    let inputs = inputs();
    let chain = Chain::new(&[JointKind::Revolute; 6], &inputs.parameters);
    let free = FreeParameters::from_indices(inputs.free.iter().map(|&index| index as usize));
    match (chain, free) {
        (Ok(chain), Ok(free)) => fit(chain, &Lengths { measurements: inputs.measurements(), free: &free }, MEMORY),
        _ => say(format_args!("the inputs are no robot of six joints")),
    }
    end()
}

fn fit(design: Chain<f32>, problem: &impl ballbar::Problem<f32, Values = Chain<f32>>, memory: &mut [f32]) {
    // Columns in metres and in radians differ a hundredfold, which single precision has no digits to spare for.
    let options = LmOptions { damping: Damping::Diagonal, ..LmOptions::default() };
    let began = FREE_TIMER.elapsed();
    let Ok(minimum) = minimise(problem, design, &options, memory, |_| ()) else {
        return say(format_args!("the memory is too short"));
    };
    let counts = FREE_TIMER.elapsed().wrapping_sub(began);
    say(format_args!("{}", minimum.status.name()));
    say(format_args!("{}", minimum.steps));
    say(format_args!("{}", u64::from(counts) * u64::from(INSTRUCTIONS_PER_COUNT) / 1000));
    for value in minimum.values.parameters() {
        say(format_args!("{:08x}", value.to_bits()));
    }
}
