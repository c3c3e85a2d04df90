//! Poses of the tool by `robot.rs`, constants that `host-cal export` wrote: encoder outputs are read from standard input, and for each
//! vector the 16 numbers of its 4 by 4 matrix are printed, row by row.

mod robot;

use robot::{ENCODERS, IS_PRISMATIC, LINKS};

type Matrix = [[f64; 4]; 4];

fn identity() -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
}

fn shift(x: f64, y: f64, z: f64) -> Matrix {
    let mut matrix = identity();
    [matrix[0][3], matrix[1][3], matrix[2][3]] = [x, y, z];
    matrix
}

/// From axis i towards axis j.
fn turn(i: usize, j: usize, angle: f64) -> Matrix {
    let mut matrix = identity();
    (matrix[i][i], matrix[j][j]) = (angle.cos(), angle.cos());
    (matrix[j][i], matrix[i][j]) = (angle.sin(), -angle.sin());
    matrix
}

fn pose(q: &[f64]) -> Matrix {
    let mut pose = identity();
    for (i, [x, y, z, alpha, beta, gamma]) in LINKS.into_iter().enumerate() {
        let mut next = |matrix| pose = multiply(&pose, &matrix);
        next(shift(x, y, z));
        next(turn(0, 1, alpha));
        next(turn(2, 0, beta));
        next(turn(1, 2, gamma));
        if let Some([offset, scale]) = ENCODERS.get(i) {
            let value = offset + scale * q[i];
            next(if IS_PRISMATIC[i] { shift(0.0, 0.0, value) } else { turn(0, 1, value) });
        }
    }
    pose
}

fn main() {
    for line in std::io::stdin().lines() {
        let line = line.expect("text");
        let q: Vec<f64> = line.split_whitespace().map(|word| word.parse().expect("a number")).collect();
        let numbers: Vec<String> = pose(&q).as_flattened().iter().map(|number| format!("{number:?}")).collect();
        println!("{}", numbers.join(" "));
    }
}
