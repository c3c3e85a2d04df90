//! The demo's hardware: a virtual board, and the host's end of its wire.

use ballbar::wire::{Command, Event, StreamSelection};
use ballbar::{SettledPose, StillnessCriteria};
use ballbar_calib::model::{PairingId, Rig, Robot};
use ballbar_calib::simulate::Shells;
use miette::Diagnostic;
use thiserror::Error;

use crate::board::{BAUD, BoardLink, NOMINAL_TRAVEL_M, RobotOnBoard, parameter_set};
use crate::cmd::outcome::CommandError;
use crate::files::{pose_header, pose_record};
use crate::remedies::Remedied;
use crate::robot_link::JointSpeed;
use crate::terminal::progress;
use crate::units::m_from_mm;
use crate::virtual_board::{Pace, Plant, Script, VirtualBoard, VirtualBoardOptions};

/// What the demo is about: a robot as its controller believes it to be and as it is, and where the bar can be attached.
pub(super) struct Scene {
    pub(super) design: Robot,
    pub(super) truth: Robot,
    pub(super) rig: Rig,
}

/// A board with the true robot before it, and a conversation with it.
pub(super) struct Bench<'a> {
    scene: &'a Scene,
    board: VirtualBoard,
    pub(super) link: BoardLink,
    robot: RobotOnBoard,
}

/// Poses of one shell, as they came over the wire.
pub(super) struct Collected {
    /// The text of a file of poses.
    pub(super) csv: String,
}

#[derive(Debug, Error, Diagnostic)]
enum BenchError {
    #[error("pose {number} settled {off_deg:.3} degrees away from where the robot was sent")]
    Elsewhere { number: usize, off_deg: f64 },
    #[error("pose {0} settled with the bar beyond its travel")]
    BeyondTravel(usize),
    #[error("{found} poses settled, but the robot stood at {expected}")]
    Count { found: usize, expected: usize },
    #[error("the board lost its parameters")]
    NoParameters,
}

/// Noise of every length, the paper's.
pub(super) const SIGMA_MM: f64 = 0.084;
const POSES_PER_PAIRING: usize = 90;
const RATE_HZ: u16 = 500;
const CRITERIA: StillnessCriteria = StillnessCriteria { hold_us: 300_000, band_counts: 3, band_codes: 64 };
/// How long the robot stands at a pose: its ringing dies away, and then it holds.
const DWELL_S: f64 = 0.8;
const SPEED: f64 = 120.0;
/// The servos hold whole counts, a hundredth of a degree at most.
const SENT_WITHIN_DEG: f64 = 0.05;

impl<'a> Bench<'a> {
    /// A board that holds the design's parameters and the LVDT's curve, homed, with the true robot before it.
    pub(super) fn power_up(scene: &'a Scene, seed: u64) -> Result<Self, CommandError> {
        let travel_m = scene.rig.bar.as_ref().map_or(NOMINAL_TRAVEL_M, |bar| bar.travel_m);
        let plant = Plant::new(&scene.truth, travel_m, seed)?;
        let parameters = Some(parameter_set(&scene.design, plant.lvdt())?);
        let options = VirtualBoardOptions { parameters, is_homed: true, ..VirtualBoardOptions::new(plant, Pace::Free) };
        let board = VirtualBoard::start(options)?;
        let mut link = BoardLink::connect(board.port(), BAUD)?;
        let (robot, _) = RobotOnBoard::read(&mut link)?.ok_or(BenchError::NoParameters)?;
        Ok(Self { scene, board, link, robot })
    }

    /// Sends the robot over the shells of all pairings with one bar, and takes what settles there.
    pub(super) fn collect(&mut self, what: &'static str, bar_mm: f64, seed: u64) -> Result<Collected, CommandError> {
        let Scene { design, truth, rig } = self.scene;
        let shells = Shells {
            planned_with: design,
            truth,
            rig,
            pairings: &rig.all_pairings(),
            bar_m: m_from_mm(bar_mm),
            per_pairing: POSES_PER_PAIRING,
            sigma_m: m_from_mm(SIGMA_MM),
            seed,
        };
        let speed = JointSpeed { revolute_rad_s: SPEED.to_radians(), ..JointSpeed::default() };
        let script = Script::from_shells(&shells, DWELL_S, speed, || ()).map_err(Remedied)?;
        let stations = script.stations.clone();
        self.link.act(Command::SetRate { rate_hz: RATE_HZ })?;
        self.link.act(Command::SetStillness(CRITERIA))?;
        self.board.play_with_stream(script);
        self.link.start_stream(StreamSelection { settled: true, ..StreamSelection::default() })?;

        let kinds = self.robot.kinds().to_vec();
        let pairings: Vec<PairingId> =
            shells.pairings.iter().flat_map(|&pairing| std::iter::repeat_n(pairing, shells.per_pairing)).collect();
        let mut csv = pose_header(&kinds, &[]) + "\n";
        let bar = progress(stations.len() as u64, what);
        let mut number = 0;
        while let Some(pose) = self.next_pose()? {
            number += 1;
            let (Some(station), Some(&pairing)) = (stations.get(number - 1), pairings.get(number - 1)) else { continue };
            let (q, displacement_m) = self.robot.settled(&pose);
            let off = q.as_array().iter().zip(station.q.as_array()).map(|(found, sent)| (found - sent).abs());
            let off_deg = off.fold(0.0, f64::max).to_degrees();
            if off_deg > SENT_WITHIN_DEG {
                return Err(BenchError::Elsewhere { number, off_deg }.into());
            }
            let displacement_m = displacement_m.ok_or(BenchError::BeyondTravel(number))?;
            let (chuck, sphere) = (&rig.chucks[pairing.chuck].name, &rig.spheres[pairing.sphere].name);
            csv += &(pose_record(chuck, sphere, &kinds, &q, shells.bar_m + displacement_m, &[]) + "\n");
            bar.inc(1);
        }
        bar.finish_and_clear();
        self.link.act(Command::StopStream)?;
        if number != stations.len() {
            return Err(BenchError::Count { found: number, expected: stations.len() }.into());
        }
        Ok(Collected { csv })
    }

    /// The next pose that settles; `None` when the robot is done and nothing is on its way any more.
    fn next_pose(&mut self) -> Result<Option<SettledPose>, CommandError> {
        loop {
            let is_over = self.board.is_done() && self.board.is_drained();
            match self.link.next_frame()? {
                Some(frame) => {
                    if let Ok(stream) = frame.message
                        && let Event::Settled(pose) = stream.event
                    {
                        return Ok(Some(pose));
                    }
                }
                None if is_over => return Ok(None),
                None => {}
            }
        }
    }
}
