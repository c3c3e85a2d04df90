//! A fit on the board's processor, in single precision, beside the host's.
#![cfg(unix)]

use ballbar::{Chain, FreeParameters, Measurement, Parameter};
use ballbar_calib::identify::{LmOptions, solve_lengths};
use ballbar_calib::simulate::tool_error;
use ballbar_tests::emulator::{Image, is_skipped, loaded, output_of};
use ballbar_tests::experiment::Puma;

/// RMS at the tool of what is between the two fits, over random joint vectors, millimetres; and the instructions of the board's, millions.
fn apart(puma: &Puma, per_pairing: usize) -> (f64, f64) {
    let measurements: Vec<Measurement<f64>> = puma.shells(0.46, per_pairing, 0.084e-3, 1).measurements();
    let design = &puma.design.chain;
    let is_free = |index: &usize| !design.is_conventionally_held(Parameter::from_index(*index));
    let free = FreeParameters::from_indices((0..54).filter(is_free)).unwrap();
    let on_host = solve_lengths(design, &measurements, &free, &LmOptions::default());
    assert!(on_host.status.is_minimum());

    let output = output_of(Image::An386Fit, &loaded(design, &measurements));
    let mut lines = output.lines();
    let mut line = || lines.next().unwrap_or_else(|| panic!("the program printed {output}"));
    assert_eq!(line(), "converged", "{output}");
    let (steps, kilo_instructions): (usize, f64) = (line().parse().unwrap(), line().parse().unwrap());
    let parameters: Vec<f64> = (0..54).map(|_| f64::from(f32::from_bits(u32::from_str_radix(line(), 16).unwrap()))).collect();
    let on_board = Chain::new(design.joint_kinds(), &parameters).unwrap();
    let apart_mm = tool_error(&on_host.chain, &on_board, &puma.truth.limits, 1000, 1).rms_m * 1e3;
    let mega = kilo_instructions / 1e3;
    println!("{} poses: {apart_mm:.1e} mm apart at the tool, {steps} steps, {mega:.1} million instructions", measurements.len());
    (apart_mm, mega)
}

/// Measured: 5.2e-4 mm in 3 million instructions and 1.6e-4 mm in 20 million.
#[test]
fn a_fit_on_the_board_is_that_of_the_host() {
    if is_skipped() {
        return;
    }
    let puma = Puma::default();
    // Thirteen and a third a pairing are not to be had: 117 poses of nine pairings.
    assert!(apart(&puma, 13).0 < 2e-3);
    assert!(apart(&puma, 90).0 < 5e-4);
}
