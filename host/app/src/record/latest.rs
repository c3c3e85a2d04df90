//! What is known of the arm at this moment.

use ballbar::wire::{Status, StreamedPose};
use ballbar::{Chain, JointTerms, Kinematics, LvdtReading, Pairing, Sample, Stillness};
use serde::{Serialize, Serializer};

use crate::board::RobotOnBoard;
use crate::units::{ScreenUnit, mm_from_m};

/// The latest values, in the units of the screen.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Latest {
    /// Time by the board's clock, seconds.
    pub t_s: Option<f64>,
    /// Encoder positions.
    pub counts: Vec<i32>,
    /// Degrees or millimetres, when the board holds parameters.
    pub q: Option<Vec<f64>>,
    /// Code of the LVDT.
    pub code: Option<u16>,
    /// From mid travel; none when the bar is off or beyond its travel.
    pub displacement_mm: Option<f64>,
    /// Bar and displacement together, where the bar is known.
    pub length_mm: Option<f64>,
    /// Travel left inwards and outwards.
    pub travel_left_mm: Option<[f64; 2]>,
    /// The tool's origin in the base frame.
    pub position_mm: Option<[f64; 3]>,
    /// moving, settling or settled, as far as is known.
    #[serde(serialize_with = "in_words")]
    pub stillness: Option<Stillness>,
}

/// Computes the length that the board's parameters expect.
#[derive(Clone, Debug)]
pub(super) struct ExpectedLength {
    chain: Chain<f64>,
    terms: JointTerms<f64>,
    pairing: Pairing<f64>,
}

impl ExpectedLength {
    /// Between the ends that the bar joins; `None` when the board's parameters make no chain.
    pub(super) fn new(robot: &RobotOnBoard, pairing: Pairing<f64>) -> Option<Self> {
        let parameters: Vec<f64> = robot.set().parameters.iter().map(|&value| f64::from(value)).collect();
        let chain = Chain::new(robot.kinds(), &parameters).ok()?;
        Some(Self { chain, terms: robot.set().joint_terms().ok()?.cast(), pairing })
    }

    /// Millimetres, at joint values in degrees or millimetres.
    pub(super) fn length_mm(&self, q: &[f64]) -> Option<f64> {
        let si: Vec<f64> = self.chain.joint_kinds().iter().zip(q).map(|(&kind, &q)| ScreenUnit::from(kind).to_si(q)).collect();
        let q = self.chain.joint_vector(&si).ok()?;
        Some(mm_from_m(Kinematics::with_terms(&self.chain, &self.terms).length(&q, &self.pairing)))
    }
}

impl Latest {
    /// Takes the channels of a sample, with the length of the bar at mid travel where it is known.
    pub(super) fn take_sample(&mut self, sample: &Sample, robot: Option<&RobotOnBoard>, bar_mm: Option<f64>) {
        self.t_s = Some(sample.t_us as f64 * 1e-6);
        self.take_channels(&sample.counts, sample.lvdt, robot, bar_mm);
    }

    /// Takes the channels of a status, as [`Latest::take_sample`].
    pub(super) fn take_status(&mut self, status: &Status, robot: Option<&RobotOnBoard>, bar_mm: Option<f64>) {
        let counts: Vec<i32> = status.encoders.iter().map(|encoder| encoder.counts).collect();
        self.t_s = Some(status.uptime_us as f64 * 1e-6);
        self.take_channels(&counts, status.lvdt, robot, bar_mm);
        self.take_stillness(status.stillness);
    }

    /// Takes whether the arm stands still.
    pub(super) fn take_stillness(&mut self, stillness: Stillness) {
        self.stillness = Some(stillness);
    }

    /// Takes a pose of the tool.
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
}

/// `moving`, `settling` or `settled`.
pub fn stillness_name(stillness: Stillness) -> &'static str {
    match stillness {
        Stillness::Moving => "moving",
        Stillness::Settling => "settling",
        Stillness::Settled => "settled",
    }
}

fn in_words<S: Serializer>(stillness: &Option<Stillness>, serializer: S) -> Result<S::Ok, S::Error> {
    stillness.map(stillness_name).serialize(serializer)
}
