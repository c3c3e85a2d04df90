//! A bench: a virtual board, the host's end of its wire, and a robot that goes over whole shells.

use ballbar::wire::{Command, Event, StreamSelection};
use ballbar::{SettledPose, StillnessCriteria};
use ballbar_calib::model::{PairingId, Rig, Robot};
use ballbar_calib::simulate::{ShellError, Shells};
use miette::Diagnostic;
use thiserror::Error;

use super::{Pace, Plant, PlantError, Script, VirtualBoard, VirtualBoardError, VirtualBoardOptions};
use crate::board::{BAUD, BoardError, BoardLink, NOMINAL_TRAVEL_M, RobotOnBoard, SetError, parameter_set};
use crate::files::{pose_header, pose_record};
use crate::remedies::Remedied;
use crate::robot_link::JointSpeed;

/// What stands on a bench: a robot as its controller believes it to be and as it is, and where the bar can be attached.
#[derive(Clone, Debug)]
pub struct Scene {
    /// As the controller believes it to be.
    pub design: Robot,
    /// As it is.
    pub truth: Robot,
    /// Chucks and spheres.
    pub rig: Rig,
}

/// A board with the true robot before it, and a conversation with it.
pub struct Bench<'a> {
    scene: &'a Scene,
    board: VirtualBoard,
    /// The host's end of the wire.
    pub link: BoardLink,
    robot: RobotOnBoard,
}

/// Poses on the shells of all pairings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BenchRun {
    /// Length of the bar at mid travel, metres.
    pub bar_m: f64,
    /// Poses on each shell.
    pub per_pairing: usize,
    /// Noise of every length, metres.
    pub sigma_m: f64,
    /// Of poses and noise.
    pub seed: u64,
}

/// Why a bench gives no poses.
#[derive(Debug, Error, Diagnostic)]
pub enum BenchError {
    /// The robot does not move as robots do.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Plant(#[from] PlantError),
    /// The design cannot be put on a board.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Set(#[from] SetError),
    /// The board does not start.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Start(#[from] VirtualBoardError),
    /// The board does not do what it is told.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Board(#[from] BoardError),
    /// The robot does not reach the shells.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Shells(#[from] Remedied<ShellError>),
    /// The robot is not where its script has it.
    #[error("pose {number} settled {off_deg:.3} degrees away from where the robot was sent")]
    Elsewhere {
        /// From 1.
        number: usize,
        /// How far the worst joint is off.
        off_deg: f64,
    },
    /// The bar is longer or shorter than it can be.
    #[error("pose {0} settled with the bar beyond its travel")]
    BeyondTravel(usize),
    /// Poses are missing, or there are more than stations.
    #[error("{found} poses settled, but the robot stood at {expected}")]
    Count {
        /// Poses.
        found: usize,
        /// Stations.
        expected: usize,
    },
    /// The board that was given parameters has none.
    #[error("the board lost its parameters")]
    NoParameters,
}

const RATE_HZ: u16 = 500;
const CRITERIA: StillnessCriteria = StillnessCriteria { hold_us: 300_000, band_counts: 3, band_codes: 64 };
/// How long the robot stands at a pose: its ringing dies away, and then it holds.
const DWELL_S: f64 = 0.8;
const SPEED_DEG_S: f64 = 120.0;
/// The servos hold whole counts, a hundredth of a degree at most.
const SENT_WITHIN_DEG: f64 = 0.05;

impl<'a> Bench<'a> {
    /// A board that holds the design's parameters and the LVDT's curve, homed, with the true robot before it.
    ///
    /// # Errors
    /// [`BenchError`].
    pub fn power_up(scene: &'a Scene, seed: u64) -> Result<Self, BenchError> {
        let travel_m = scene.rig.bar.as_ref().map_or(NOMINAL_TRAVEL_M, |bar| bar.travel_m);
        let plant = Plant::new(&scene.truth, travel_m, seed)?;
        let parameters = Some(parameter_set(&scene.design, plant.lvdt())?);
        let options = VirtualBoardOptions { parameters, is_homed: true, ..VirtualBoardOptions::new(plant, Pace::Free) };
        let board = VirtualBoard::start(options)?;
        let mut link = BoardLink::connect(board.port(), BAUD)?;
        let (robot, _) = RobotOnBoard::read(&mut link)?.ok_or(BenchError::NoParameters)?;
        Ok(Self { scene, board, link, robot })
    }

    /// Sends the robot over the shells of all pairings with one bar. Returns what settled there, as the text of a file of poses. `on_pose` is
    /// called for each.
    ///
    /// # Errors
    /// [`BenchError`].
    pub fn collect(&mut self, run: &BenchRun, mut on_pose: impl FnMut()) -> Result<String, BenchError> {
        let Scene { design, truth, rig } = self.scene;
        let &BenchRun { bar_m, per_pairing, sigma_m, seed } = run;
        let shells =
            Shells { planned_with: design, truth, rig, pairings: &rig.all_pairings(), bar_m, per_pairing, sigma_m, seed };
        let speed = JointSpeed { revolute_rad_s: SPEED_DEG_S.to_radians(), ..JointSpeed::default() };
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
        let mut number = 0;
        while let Some(pose) = self.next_pose()? {
            number += 1;
            let (Some(station), Some(&pairing)) = (stations.get(number - 1), pairings.get(number - 1)) else { continue };
            let (q, displacement_m) = self.robot.settled(&pose);
            let off = q.as_array().iter().zip(station.q.as_array()).map(|(found, sent)| (found - sent).abs());
            let off_deg = off.fold(0.0, f64::max).to_degrees();
            if off_deg > SENT_WITHIN_DEG {
                return Err(BenchError::Elsewhere { number, off_deg });
            }
            let displacement_m = displacement_m.ok_or(BenchError::BeyondTravel(number))?;
            let (chuck, sphere) = (&rig.chucks[pairing.chuck].name, &rig.spheres[pairing.sphere].name);
            csv += &(pose_record(chuck, sphere, &kinds, &q, shells.bar_m + displacement_m, &[]) + "\n");
            on_pose();
        }
        self.link.act(Command::StopStream)?;
        if number != stations.len() {
            return Err(BenchError::Count { found: number, expected: stations.len() });
        }
        Ok(csv)
    }

    /// The next pose that settles; `None` when the robot is done and nothing is on its way any more.
    fn next_pose(&mut self) -> Result<Option<SettledPose>, BenchError> {
        loop {
            let is_over = self.board.is_done() && self.board.is_drained();
            match self.link.next_frame().map_err(BoardError::from)? {
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
