//! Faults of each kind, and rows that have them.

use super::*;

/// Simulated lengths of all nine pairings with two rods; the robot's encoders have an index every 7.2 degrees.
pub(super) struct Bench {
    pub(super) puma: Puma,
    pub(super) clean: Dataset,
    pub(super) sigma_m: f64,
    pub(super) rng: ChaCha8Rng,
}

pub(super) const TURN: f64 = TAU / 50.0;

impl Bench {
    pub(super) fn new(seed: u64, sigma_m: f64) -> Self {
        let mut puma = Puma::default();
        for facts in &mut puma.design.encoders {
            facts.encoder = Some(Encoder { counts_per_unit: 1000.0 / TURN, counts_per_index: 1000 });
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut rows = puma.shells(0.46, 17, sigma_m, seed).rows;
        rows.extend(puma.shells(0.61, 16, sigma_m, seed + 1000).rows);
        // Pairing after pairing, or in any order.
        if seed % 2 == 1 {
            rows.shuffle(&mut rng);
        }
        Self { puma, clean: Dataset::new("simulated", rows).unwrap(), sigma_m, rng }
    }

    pub(super) fn count(&self) -> usize {
        self.clean.rows.len()
    }

    pub(super) fn some(&mut self, share: f64) -> Vec<usize> {
        let mut rows: Vec<usize> = (0..self.count()).collect();
        rows.shuffle(&mut self.rng);
        rows.truncate(((self.count() as f64 * share).round() as usize).max(1));
        rows.sort_unstable();
        rows
    }

    pub(super) fn block(&mut self, share: f64) -> Vec<usize> {
        let count = ((self.count() as f64 * share).round() as usize).max(1);
        let first = self.rng.random_range(1..self.count() - count);
        (first..first + count).collect()
    }

    pub(super) fn named(&self, row: usize) -> PairingId {
        self.clean.rows[row].pairing
    }

    pub(super) fn told(&self, spoiled: &Dataset, wrong: &[usize]) -> Told {
        Told::new(&self.puma.design, &self.puma.rig, spoiled, self.sigma_m, |row| wrong.contains(&row))
    }

    pub(super) fn rename(&self, spoiled: &mut Dataset, row: usize, pairing: PairingId) {
        spoiled.rows[row].pairing = pairing;
        spoiled.rows[row].measurement.pairing = self.puma.rig.pairing(pairing);
    }
}

/// Whether a cause is the right one.
pub(super) type IsIt = Box<dyn Fn(&CauseKind) -> bool>;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    OtherPairing,
    Chucks,
    Spheres,
    OtherSphere,
    Metres,
    Inches,
    OtherRod,
    Shifted,
    Repeated,
    Turn,
    Offset,
    OffsetOfBlock,
    Sign,
    Joints,
    Radians,
    Block,
    SphereSlips,
    ChuckSlips,
}

impl Fault {
    pub(super) const ALL: [Self; 18] = [
        Self::OtherPairing,
        Self::Chucks,
        Self::Spheres,
        Self::OtherSphere,
        Self::Metres,
        Self::Inches,
        Self::OtherRod,
        Self::Shifted,
        Self::Repeated,
        Self::Turn,
        Self::Offset,
        Self::OffsetOfBlock,
        Self::Sign,
        Self::Joints,
        Self::Radians,
        Self::Block,
        Self::SphereSlips,
        Self::ChuckSlips,
    ];

    /// Rows that are wrong, and whether a cause of this kind, with these numbers, is the right one.
    pub(super) fn inject(self, bench: &mut Bench, spoiled: &mut Dataset, share: f64) -> (Vec<usize>, IsIt) {
        let joint = bench.rng.random_range(0..5);
        let rows = match self {
            Self::OtherPairing | Self::Metres | Self::Inches | Self::OtherRod | Self::Turn | Self::Offset => bench.some(share),
            Self::SphereSlips | Self::ChuckSlips => {
                let first = ((1.0 - share) * bench.count() as f64) as usize;
                (first..bench.count()).collect()
            }
            _ => bench.block(share),
        };
        let rows = match self {
            Self::Chucks => rows.into_iter().filter(|&row| bench.named(row).chuck < 2).collect(),
            Self::Spheres => rows.into_iter().filter(|&row| bench.named(row).sphere > 0).collect(),
            Self::OtherSphere => bench.some(3.0 * share).into_iter().filter(|&row| bench.named(row).sphere == 1).collect(),
            _ => rows,
        };
        let rng = &mut bench.rng.clone();
        let angle = rng.random_range(0.03..0.5) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let slip = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)).normalize() * 1.3e-3;
        let moved = match self {
            Self::ChuckSlips => Some((End::Chuck, bench.named(bench.count() - 1).chuck)),
            Self::SphereSlips => Some((End::Sphere, bench.named(bench.count() - 1).sphere)),
            _ => None,
        };
        let truth = bench.puma.truth.kinematics();
        let rows: Vec<usize> = match moved {
            Some((end, which)) => rows.into_iter().filter(|&row| bench.named(row).at(end) == which).collect(),
            None => rows,
        };
        for &row in &rows {
            let PairingId { chuck, sphere } = bench.named(row);
            let measurement = spoiled.rows[row].measurement;
            let q = measurement.q;
            let other = |index: usize| (index + one_or_two(row)) % 3;
            match self {
                Self::OtherPairing => {
                    let pairing = if row % 3 == 0 {
                        PairingId { chuck: other(chuck), sphere }
                    } else if row % 3 == 1 {
                        PairingId { chuck, sphere: other(sphere) }
                    } else {
                        PairingId { chuck: other(chuck), sphere: other(sphere) }
                    };
                    bench.rename(spoiled, row, pairing);
                }
                Self::Chucks => bench.rename(spoiled, row, PairingId { chuck: 1 - chuck, sphere }),
                Self::Spheres => bench.rename(spoiled, row, PairingId { chuck, sphere: 3 - sphere }),
                Self::OtherSphere => bench.rename(spoiled, row, PairingId { chuck, sphere: 2 }),
                Self::Metres => spoiled.rows[row].measurement.length_m /= 1e3,
                Self::Inches => spoiled.rows[row].measurement.length_m /= 25.4,
                Self::OtherRod => spoiled.rows[row].measurement.length_m += 0.15,
                Self::Shifted => {
                    spoiled.rows[row].measurement.length_m = bench.clean.rows[row - 1].measurement.length_m;
                }
                Self::Repeated => {
                    spoiled.rows[row].measurement.length_m = bench.clean.rows[rows[0] - 1].measurement.length_m;
                }
                Self::Turn => spoiled.rows[row].measurement.q.as_array_mut()[joint] += TURN,
                Self::Offset | Self::OffsetOfBlock => spoiled.rows[row].measurement.q.as_array_mut()[joint] += angle,
                Self::Sign => spoiled.rows[row].measurement.q.as_array_mut()[joint] *= -1.0,
                Self::Joints => spoiled.rows[row].measurement.q.as_array_mut().swap(joint, joint + 1),
                Self::Radians => {
                    spoiled.rows[row].measurement.q.as_array_mut().iter_mut().for_each(|q| *q = q.to_radians());
                }
                Self::Block => spoiled.rows[row].measurement.length_m += 0.5e-3,
                Self::SphereSlips | Self::ChuckSlips => {
                    let mut pairing = bench.puma.rig.pairing(bench.named(row));
                    let before_m = truth.length(&q, &pairing);
                    match moved.unwrap().0 {
                        End::Chuck => pairing.chuck_base_m += slip,
                        End::Sphere => pairing.sphere_tool_m += slip,
                    }
                    spoiled.rows[row].measurement.length_m += truth.length(&q, &pairing) - before_m;
                }
            }
        }
        let joint_is = move |other: usize| other == joint;
        let is_it: IsIt = match self {
            Self::OtherPairing => Box::new(|kind| {
                matches!(
                    kind,
                    CauseKind::OtherPairing { .. }
                        | CauseKind::OtherPairings { .. }
                        | CauseKind::EndsExchanged { .. }
                        | CauseKind::OtherEnd { .. }
                )
            }),
            Self::Chucks => Box::new(|kind| {
                matches!(
                    kind,
                    CauseKind::EndsExchanged { end: End::Chuck, between: [0, 1] } | CauseKind::OtherEnd { end: End::Chuck, .. }
                )
            }),
            Self::Spheres => Box::new(|kind| {
                matches!(
                    kind,
                    CauseKind::EndsExchanged { end: End::Sphere, between: [1, 2] } | CauseKind::OtherEnd { end: End::Sphere, .. }
                )
            }),
            Self::OtherSphere => Box::new(|kind| *kind == CauseKind::OtherEnd { end: End::Sphere, named: 2, really: 1 }),
            Self::Metres | Self::Inches => Box::new(|kind| matches!(kind, CauseKind::LengthUnit(_))),
            Self::OtherRod => Box::new(|kind| matches!(kind, CauseKind::OtherRod { .. })),
            Self::Shifted => Box::new(|kind| *kind == CauseKind::LengthShifted { by: -1 }),
            Self::Repeated => Box::new(|kind| *kind == CauseKind::LengthRepeated),
            Self::Turn => {
                Box::new(move |kind| matches!(*kind, CauseKind::EncoderTurns { joint, turns: 1, .. } if joint_is(joint)))
            }
            Self::Offset | Self::OffsetOfBlock => Box::new(
                move |kind| matches!(*kind, CauseKind::JointOffset { joint, by } if joint_is(joint) && (by - angle).abs() < 1e-3),
            ),
            Self::Sign => Box::new(move |kind| matches!(*kind, CauseKind::JointSign { joint } if joint_is(joint))),
            Self::Joints => Box::new(move |kind| *kind == CauseKind::JointsExchanged { between: [joint, joint + 1] }),
            Self::Radians => Box::new(|kind| matches!(kind, CauseKind::AngleUnit(_))),
            Self::Block => Box::new(|kind| matches!(*kind, CauseKind::LengthOffset { by_m, .. } if (by_m - 0.5e-3).abs() < 1e-4)),
            Self::SphereSlips | Self::ChuckSlips => Box::new(move |kind| {
                let (end, which) = moved.unwrap();
                matches!(*kind, CauseKind::Displaced { end: e, which: w, .. } if e == end && w == which)
            }),
        };
        bench.rng = ChaCha8Rng::seed_from_u64(rng.random());
        (rows, is_it)
    }
}

/// Takes turns: 1 or 2, three rows each.
pub(super) fn one_or_two(row: usize) -> usize {
    1 + row / 3 % 2
}

/// Gross errors of up to 20 mm in rows that are not wrong yet.
pub(super) fn gross(bench: &mut Bench, spoiled: &mut Dataset, share: f64, wrong: &[usize]) -> Vec<usize> {
    let mut rows = bench.some(share);
    rows.retain(|row| !wrong.contains(row));
    for &row in &rows {
        let size_m = bench.rng.random_range(1e-3..20e-3);
        spoiled.rows[row].measurement.length_m += if bench.rng.random_bool(0.5) { size_m } else { -size_m };
    }
    rows
}

impl Fault {
    /// So many rows left out show it: more than a fault has unknown numbers.
    pub(super) fn fewest(self) -> usize {
        match self {
            Self::Block | Self::Offset | Self::OffsetOfBlock => 4,
            Self::SphereSlips | Self::ChuckSlips => 8,
            _ => 2,
        }
    }
}
