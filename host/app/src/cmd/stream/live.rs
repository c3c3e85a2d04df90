//! What is known of the arm at this moment, in numbers and in a line.

use ballbar::wire::{Status, StreamedPose};
use ballbar::{Chain, JointKind, Kinematics, LvdtReading, Pairing, Sample, Stillness};
use serde::{Serialize, Serializer};

use crate::board::RobotOnBoard;
use crate::units::{ScreenUnit, fixed, joints_text, mm_from_m};

/// The latest values, in the units of the screen.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Latest {
    /// Time by the board's clock, seconds.
    pub(super) t_s: Option<f64>,
    /// Encoder positions.
    pub(super) counts: Vec<i32>,
    /// Degrees or millimetres, when the board holds parameters.
    pub(super) q: Option<Vec<f64>>,
    /// Code of the LVDT.
    pub(super) code: Option<u16>,
    /// From mid travel; none when the bar is off or beyond its travel.
    pub(super) displacement_mm: Option<f64>,
    /// Bar and displacement together, when --bar was given.
    pub(super) length_mm: Option<f64>,
    /// Travel left inwards and outwards.
    pub(super) travel_left_mm: Option<[f64; 2]>,
    /// The tool's origin in the base frame.
    pub(super) position_mm: Option<[f64; 3]>,
    /// moving, settling or settled, as far as is known.
    #[serde(serialize_with = "in_words")]
    pub(super) stillness: Option<Stillness>,
}

/// Computes the length that the board's parameters expect.
pub(super) struct Model {
    chain: Chain<f64>,
    pairing: Pairing<f64>,
}

impl Model {
    /// `None` when the board's parameters make no chain.
    pub(super) fn new(robot: &RobotOnBoard, pairing: Pairing<f64>) -> Option<Self> {
        let parameters: Vec<f64> = robot.set().parameters.iter().map(|&value| f64::from(value)).collect();
        let chain = Chain::new(robot.kinds(), &parameters).ok()?;
        Some(Self { chain, pairing })
    }

    /// Millimetres, at joint values in degrees or millimetres.
    pub(super) fn length_mm(&self, q: &[f64]) -> Option<f64> {
        let si: Vec<f64> = self.chain.joint_kinds().iter().zip(q).map(|(&kind, &q)| ScreenUnit::from(kind).to_si(q)).collect();
        let q = self.chain.joint_vector(&si).ok()?;
        Some(mm_from_m(Kinematics::new(&self.chain).length(&q, &self.pairing)))
    }
}

impl Latest {
    pub(super) fn take_sample(&mut self, sample: &Sample, robot: Option<&RobotOnBoard>, bar_mm: Option<f64>) {
        self.t_s = Some(sample.t_us as f64 * 1e-6);
        self.take_channels(&sample.counts, sample.lvdt, robot, bar_mm);
    }

    pub(super) fn take_status(&mut self, status: &Status, robot: Option<&RobotOnBoard>, bar_mm: Option<f64>) {
        let counts: Vec<i32> = status.encoders.iter().map(|encoder| encoder.counts).collect();
        self.t_s = Some(status.uptime_us as f64 * 1e-6);
        self.take_channels(&counts, status.lvdt, robot, bar_mm);
        self.take_stillness(status.stillness);
    }

    pub(super) fn take_stillness(&mut self, stillness: Stillness) {
        self.stillness = Some(stillness);
    }

    pub(super) fn take_pose(&mut self, pose: &StreamedPose) {
        self.position_mm = Some(pose.pose.position_m.map(|m| mm_from_m(f64::from(m))));
    }

    fn take_channels(&mut self, counts: &[i32], lvdt: LvdtReading, robot: Option<&RobotOnBoard>, bar_mm: Option<f64>) {
        self.counts = counts.to_vec();
        self.code = (!lvdt.saturated).then_some(lvdt.code);
        let Some(robot) = robot else { return };
        let q = robot.q(counts.iter().map(|&counts| f64::from(counts)));
        let screen = robot.kinds().iter().zip(q.as_array());
        self.q = Some(screen.map(|(&kind, &q)| ScreenUnit::from(kind).from_si(q)).collect());
        self.displacement_mm = robot.displacement_m(lvdt).map(mm_from_m);
        self.length_mm = self.displacement_mm.zip(bar_mm).map(|(displacement, bar)| bar + displacement);
        let (least, most) = robot.set().lvdt.travel_m::<f64>();
        self.travel_left_mm = self.displacement_mm.map(|now| [now - mm_from_m(least), mm_from_m(most) - now]);
    }

    pub(super) fn text(&self, kinds: &[JointKind]) -> String {
        let mut parts = Vec::new();
        match &self.q {
            Some(q) => {
                let si: Vec<f64> = kinds.iter().zip(q).map(|(&kind, &q)| ScreenUnit::from(kind).to_si(q)).collect();
                parts.push(joints_text(kinds, &si));
            }
            None if !self.counts.is_empty() => parts.push(format!("counts {:?}", self.counts)),
            None => {}
        }
        parts.push(match (self.length_mm, self.displacement_mm, self.code) {
            (Some(length), ..) => format!("length {} mm", fixed(length, 3)),
            (None, Some(displacement), _) => format!("bar {displacement:+.3} mm"),
            (None, None, Some(code)) if self.q.is_none() => format!("code {code}"),
            _ => "no bar within its travel".into(),
        });
        parts.extend(self.travel_left_mm.map(|[inwards, outwards]| format!("{inwards:.1} | {outwards:.1} mm left")));
        parts.extend(self.position_mm.map(|[x, y, z]| format!("tool {x:.3} {y:.3} {z:.3} mm")));
        parts.extend(self.stillness.map(|stillness| word(stillness).to_owned()));
        parts.join("  ")
    }
}

fn word(stillness: Stillness) -> &'static str {
    match stillness {
        Stillness::Moving => "moving",
        Stillness::Settling => "settling",
        Stillness::Settled => "settled",
    }
}

fn in_words<S: Serializer>(stillness: &Option<Stillness>, serializer: S) -> Result<S::Ok, S::Error> {
    stillness.map(word).serialize(serializer)
}
