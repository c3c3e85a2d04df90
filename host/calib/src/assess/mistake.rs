//! Mistakes that people make with measurements, and the measurements without them.

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;
use std::fmt;

use ballbar::{JointKind, Measurement};

use super::evidence::Evidence;
use crate::identify::{median, residuals};
use crate::model::{End, NamedPoint, PairingId, PoseRow};
use crate::units::{fixed, mm_from_m};

/// One mistake, of all rows alike.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mistake {
    words: String,
    remedy: Remedy,
}

impl fmt::Display for Mistake {
    /// In the middle of a sentence: `chucks B and C look exchanged`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)
    }
}

/// How rows are put right.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
enum Remedy {
    /// The chuck that each name stands for, by index.
    Chucks(Vec<usize>),
    /// The sphere that each name stands for, by index.
    Spheres(Vec<usize>),
    /// The other sign of a coordinate (0 to 2) of all chucks, or of all spheres.
    Mirrored { end: End, axis: usize },
    /// Each other's values, by index.
    Joints(usize, usize),
    /// The other sign, by index.
    Sign(usize),
    /// Factors of angles, of slides, and of lengths.
    Units { angle: f64, slide: f64, length: f64 },
    /// The length of the row so many further on.
    NextLength(isize),
    /// Metres to add to each length.
    Add(Vec<f64>),
}

impl Mistake {
    /// The measurements without it.
    pub(super) fn put_right(&self, evidence: &Evidence<'_>) -> Vec<Measurement<f64>> {
        let Evidence { robot, rig, dataset, .. } = evidence;
        let rows = &dataset.rows;
        let of_pairing = |row: &PoseRow, chuck: usize, sphere: usize| {
            let pairing = rig.pairing(PairingId { chuck, sphere });
            Measurement { pairing, ..row.measurement }
        };
        let correct = |(i, row): (usize, &PoseRow)| {
            let PairingId { chuck, sphere } = row.pairing;
            let mut right = row.measurement;
            match &self.remedy {
                Remedy::Chucks(stands_for) => right = of_pairing(row, stands_for[chuck], sphere),
                Remedy::Spheres(stands_for) => right = of_pairing(row, chuck, stands_for[sphere]),
                Remedy::Mirrored { end: End::Chuck, axis } => right.pairing.chuck_base_m[*axis] *= -1.0,
                Remedy::Mirrored { end: End::Sphere, axis } => right.pairing.sphere_tool_m[*axis] *= -1.0,
                Remedy::Joints(a, b) => right.q.as_array_mut().swap(*a, *b),
                Remedy::Sign(joint) => right.q.as_array_mut()[*joint] *= -1.0,
                Remedy::Units { angle, slide, length } => {
                    for (q, kind) in right.q.as_array_mut().iter_mut().zip(robot.chain.joint_kinds()) {
                        *q *= if *kind == JointKind::Revolute { angle } else { slide };
                    }
                    right.length_m *= length;
                }
                Remedy::NextLength(by) => {
                    let other = i.checked_add_signed(*by)?;
                    right.length_m = rows.get(other)?.measurement.length_m;
                }
                Remedy::Add(add_m) => right.length_m += add_m[i],
            }
            Some(right)
        };
        rows.iter().enumerate().filter_map(correct).collect()
    }
}

/// The mistakes that may be looked for in these measurements, the likeliest first: those that leave the measurements as they are
/// are not among them.
pub(super) fn conceivable(evidence: &Evidence<'_>) -> Vec<Mistake> {
    let Evidence { robot, rig, dataset, .. } = evidence;
    let kinds = robot.chain.joint_kinds();
    let used = |end: fn(PairingId) -> usize| dataset.pairings().into_iter().map(end).collect::<HashSet<_>>();
    let mut mistakes = exchanges("chucks", &rig.chucks, &used(|pairing| pairing.chuck), Remedy::Chucks);
    mistakes.extend(exchanges("spheres", &rig.spheres, &used(|pairing| pairing.sphere), Remedy::Spheres));
    for i in 0..kinds.len() {
        mistakes.push(Mistake {
            words: format!("joint {} looks as if it were counted with the wrong sign", i + 1),
            remedy: Remedy::Sign(i),
        });
        mistakes.extend(
            (i + 1..kinds.len()).filter(|&j| kinds[i] == kinds[j]).map(|j| Mistake {
                words: format!("joints {} and {} look exchanged", i + 1, j + 1),
                remedy: Remedy::Joints(i, j),
            }),
        );
    }
    for (end, what) in [(End::Chuck, "chucks"), (End::Sphere, "spheres")] {
        mistakes.extend(["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| Mistake {
            words: format!("all {what} look mirrored: their {name} has the wrong sign"),
            remedy: Remedy::Mirrored { end, axis },
        }));
    }
    mistakes.extend(units(kinds));
    for (by, which) in [(1, "next"), (-1, "previous")] {
        mistakes.push(Mistake {
            words: format!("each length looks like that of the {which} pose, as if the columns were one row apart"),
            remedy: Remedy::NextLength(by),
        });
    }
    mistakes.extend(rods(evidence));
    mistakes
}

/// Two ends exchanged, of which one at least is used; and three that are used, in a ring.
fn exchanges(what: &str, ends: &[NamedPoint], used: &HashSet<usize>, remedy: fn(Vec<usize>) -> Remedy) -> Vec<Mistake> {
    /// Of more, each with each would be too many to try.
    const MOST: usize = 8;
    const MOST_IN_RINGS: usize = 5;
    let mut mistakes = Vec::new();
    let name = |end: usize| &ends[end].name;
    let standing = |moves: &[(usize, usize)]| {
        let mut stands_for: Vec<usize> = (0..ends.len()).collect();
        moves.iter().for_each(|&(named, really)| stands_for[named] = really);
        remedy(stands_for)
    };
    let candidates: Vec<usize> = (0..ends.len()).filter(|end| ends.len() <= MOST || used.contains(end)).take(MOST).collect();
    for (at, &a) in candidates.iter().enumerate() {
        for &b in candidates[at + 1..].iter().filter(|&b| used.contains(&a) || used.contains(b)) {
            let words = format!("{what} {} and {} look exchanged", name(a), name(b));
            mistakes.push(Mistake { words, remedy: standing(&[(a, b), (b, a)]) });
        }
    }
    let in_rings: Vec<usize> = candidates.into_iter().filter(|end| used.contains(end)).take(MOST_IN_RINGS).collect();
    for (i, &a) in in_rings.iter().enumerate() {
        for (j, &b) in in_rings.iter().enumerate().skip(i + 1) {
            for &c in &in_rings[j + 1..] {
                let all = format!("{what} {}, {} and {} look exchanged", name(a), name(b), name(c));
                for (b, c) in [(b, c), (c, b)] {
                    let (first, second, third) = (name(a), name(b), name(c));
                    let words = format!("{all}: what is called {first} is {second}, {second} is {third}, {third} is {first}");
                    mistakes.push(Mistake { words, remedy: standing(&[(a, b), (b, c), (c, a)]) });
                }
            }
        }
    }
    mistakes
}

/// Numbers of another unit than their column's.
fn units(kinds: &[JointKind]) -> Vec<Mistake> {
    const DEG_PER_RAD: f64 = 180.0 / PI;
    const MM_PER_M: f64 = 1e3;
    let mistake = |words: &str, angle, slide, length| Mistake {
        words: format!("{words} are expected"),
        remedy: Remedy::Units { angle, slide, length },
    };
    let mut mistakes = vec![
        mistake("lengths look like metres where millimetres", 1.0, 1.0, MM_PER_M),
        mistake("lengths look like inches where millimetres", 1.0, 1.0, 25.4),
        mistake("lengths look like centimetres where millimetres", 1.0, 1.0, 10.0),
        mistake("lengths look like micrometres where millimetres", 1.0, 1.0, 1e-3),
    ];
    let (turn, slide) = (kinds.contains(&JointKind::Revolute), kinds.contains(&JointKind::Prismatic));
    if turn {
        mistakes.push(mistake("angles of joints look like radians where degrees", DEG_PER_RAD, 1.0, 1.0));
        mistakes.push(mistake(
            "angles of joints look like degrees converted once more where degrees",
            1.0 / DEG_PER_RAD,
            1.0,
            1.0,
        ));
        let all = "angles and lengths look like radians and metres where degrees and millimetres";
        mistakes.push(mistake(all, DEG_PER_RAD, MM_PER_M, MM_PER_M));
    }
    if slide {
        mistakes.push(mistake("slides of joints look like metres where millimetres", 1.0, MM_PER_M, 1.0));
    }
    if turn && slide {
        mistakes.push(mistake(
            "joint values look like radians and metres where degrees and millimetres",
            DEG_PER_RAD,
            MM_PER_M,
            1.0,
        ));
    }
    mistakes
}

/// Lengths without the bar's nominal length, or made with another rod's: those of each bar, set and file for themselves.
fn rods(evidence: &Evidence<'_>) -> Option<Mistake> {
    /// How far a design's fault takes the median of residuals from what the rods differ by.
    const NEAR_M: f64 = 20e-3;
    let mut rods_m: Vec<f64> = evidence.rig.bar.iter().flat_map(|bar| bar.lengths_m.iter().copied()).collect();
    rods_m.extend(evidence.dataset.rows.iter().filter_map(|row| row.bar_m));
    rods_m.sort_by(f64::total_cmp);
    rods_m.dedup();
    let others = rods_m.iter().flat_map(|&a| rods_m.iter().filter(move |&&b| a != b).map(move |&b| a - b));
    let steps_m: Vec<f64> = rods_m.iter().copied().chain(others).chain([0.0]).collect();
    let nearest = |missing_m: f64| {
        let step_m = steps_m.iter().copied().min_by(|a, b| (a - missing_m).abs().total_cmp(&(b - missing_m).abs()))?;
        ((step_m - missing_m).abs() < NEAR_M).then_some(step_m)
    };
    let missing_m: Vec<f64> = missing_m(evidence).into_iter().map(nearest).collect::<Option<_>>()?;
    let why = if missing_m.iter().all(|step_m| rods_m.contains(step_m)) {
        "the bar's nominal length is missing"
    } else {
        "another rod was on the bar than the lengths were made with"
    };
    Some(Mistake { words: format!("{}: {why}", too_short(&missing_m)?), remedy: Remedy::Add(missing_m) })
}

/// Lengths that are too short or too long by any constant, those of each bar, set and file by their own.
pub(super) fn any_constant(evidence: &Evidence<'_>) -> Option<Mistake> {
    let missing_m = missing_m(evidence);
    let words = format!("{}, all alike: look at the bar's nominal length and zero", too_short(&missing_m)?);
    Some(Mistake { words, remedy: Remedy::Add(missing_m) })
}

/// What each row's length is too short by: the median of what those of its bar, set and file are by the design.
fn missing_m(evidence: &Evidence<'_>) -> Vec<f64> {
    let residuals = residuals(&evidence.robot.kinematics(), evidence.dataset);
    let mut groups: HashMap<_, Vec<usize>> = HashMap::new();
    for (i, row) in evidence.dataset.rows.iter().enumerate() {
        groups.entry((row.file, row.set.as_deref(), row.bar_m.map(f64::to_bits))).or_default().push(i);
    }
    let mut missing_m = vec![0.0; residuals.len()];
    for rows in groups.values() {
        let middle_m = median(rows.iter().map(|&row| residuals[row].value_m).collect());
        rows.iter().for_each(|&row| missing_m[row] = -middle_m);
    }
    missing_m
}

/// `lengths look some 460 or 610 mm too short`; `None` where they are too short by no more than a design may be off.
fn too_short(missing_m: &[f64]) -> Option<String> {
    const LEAST_M: f64 = 5e-3;
    let mut sizes_mm: Vec<f64> = missing_m.iter().filter(|m| m.abs() > LEAST_M).map(|&m| mm_from_m(m)).collect();
    sizes_mm.sort_by(f64::total_cmp);
    sizes_mm.dedup_by(|a, b| (*a - *b).abs() < 1.0);
    let side = if *sizes_mm.first()? > 0.0 { "short" } else { "long" };
    let list: Vec<String> = sizes_mm.iter().map(|mm| fixed(mm.abs(), 0)).collect();
    Some(format!("lengths look some {} mm too {side}", list.join(" or ")))
}
