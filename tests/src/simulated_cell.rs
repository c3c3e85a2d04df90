//! A robot at its rig, all simulated: the virtual board, the controller that moves the robot, and plans for it.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::Duration;

use ballbar::StillnessCriteria;
use host_cal::board::{BAUD, BoardLink, RobotOnBoard, parameter_set};
use host_cal::collect::{
    BoardWatch, CollectError, CollectOptions, Collector, Ended, Guide, Ledger, Nearness, Operator, RowState, Summary,
};
use host_cal::files::{PairingId, PlanRow, Rig, Robot, Source, read_plan, write_plan};
use host_cal::plan::{Cell, Grid, Margins, Pace as PlanPace, PlanOptions, plan};
use host_cal::robot_link::RobotLink;
use host_cal::robot_link::sim::{SimHand, SimLink};
use host_cal::session::{Recorder, Run};
use host_cal::virtual_board::{
    Controller, ControllerOptions, Driven, Driver, Pace, Plant, VirtualBoard, VirtualBoardOptions, driver,
};
use tempfile::TempDir;

use crate::command::{Run as CommandRun, host_cal_in};

/// The robot as it is.
pub const TRUTH: &str = "puma560-optimised";
/// The robot as its controller believes it to be.
pub const DESIGN: &str = "puma560";
/// Chucks, spheres and the bar.
pub const RIG: &str = "triangles";
/// Travel of the LVDT, metres.
pub const TRAVEL_M: f64 = 0.075;

/// A short plan: three pairings, eight poses each, one bar. Its text.
pub static SHORT_PLAN: LazyLock<String> = LazyLock::new(|| plan_text(8, &[0.46], &[(0, 0), (1, 1), (2, 2)]));

/// A plan's text: poses of each shell, bars in metres, chucks and spheres by index.
pub fn plan_text(poses_per_shell: usize, bars_m: &[f64], pairings: &[(usize, usize)]) -> String {
    let (design, rig) = (design(), rig());
    let options = PlanOptions {
        pairings: pairings.iter().map(|&(chuck, sphere)| PairingId { chuck, sphere }).collect(),
        bars_m: bars_m.to_vec(),
        travel_m: TRAVEL_M,
        grid: Grid::of(&[15.0, 30.0, 45.0, 60.0, 75.0], poses_per_shell),
        poses_per_shell,
        optimal: None,
        margins: Margins::default(),
        pace: PlanPace::default(),
        seed: 0,
    };
    let found = plan(&design, &rig, &options, &|_| {}).expect("the shells are in reach");
    write_plan(&design, &rig, &found.rows)
}

/// The design.
pub fn design() -> Robot {
    Robot::open(DESIGN).expect("a built-in robot")
}

/// The rig.
pub fn rig() -> Rig {
    Rig::open(RIG).expect("a built-in rig")
}

/// A plant of the true robot.
pub fn plant(seed: u64) -> Plant {
    Plant::new(&Robot::open(TRUTH).expect("a built-in robot"), TRAVEL_M, seed).expect("its encoders are known")
}

/// A board that is ready, with the robot's controller.
pub struct SimulatedCell {
    /// Holds the sessions.
    pub folder: TempDir,
    /// The board.
    pub board: VirtualBoard,
    /// The controller's address.
    pub address: String,
    /// The plan.
    pub plan: String,
}

impl SimulatedCell {
    /// With a plant, the play of the bar's ends (standard deviation, metres), and a plan's text.
    pub fn start(plant: Plant, sigma_m: f64, plan: &str) -> Self {
        let (driver, driven) = driver();
        let address = listen(driver, sigma_m);
        Self::with_address(plant, Some(driven), address, plan)
    }

    /// With whoever holds the other end of `driven`, and no controller.
    pub fn driven_by_hand(plant: Plant, driven: Driven, plan: &str) -> Self {
        Self::with_address(plant, Some(driven), String::new(), plan)
    }

    fn with_address(plant: Plant, driven: Option<Driven>, address: String, plan: &str) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        std::fs::write(folder.path().join("plan.csv"), plan).expect("the plan can be written");
        let parameters = Some(parameter_set(&design(), plant.lvdt()).expect("the robot fits a board"));
        let port_name = Some(folder.path().join("port"));
        let options =
            VirtualBoardOptions { parameters, is_homed: true, driven, port_name, ..VirtualBoardOptions::new(plant, Pace::Free) };
        let board = VirtualBoard::start(options).expect("the board starts");
        Self { folder, board, address, plan: plan.to_owned() }
    }

    /// A file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Arguments of `host-cal collect` into a session.
    pub fn collect_args(&self, session: &str) -> Vec<String> {
        let words = ["collect", "port", "--session", session, "--plan", "plan.csv", "--robot", DESIGN, "--rig", RIG];
        let link = ["--robot-link", "sim", "--robot-address", &self.address, "--speed-deg-s", "90"];
        let quick = ["--rate", "200", "--hold-ms", "200"];
        [&words[..], &link, &quick].concat().into_iter().map(str::to_owned).collect()
    }

    /// Runs `host-cal` in the folder.
    pub fn host_cal(&self, args: &[&str]) -> CommandRun {
        host_cal_in(self.folder.path(), args)
    }

    /// Runs `host-cal collect`.
    pub fn collect(&self, session: &str, more: &[&str]) -> CommandRun {
        let args = self.collect_args(session);
        self.host_cal(&args.iter().map(String::as_str).chain(more.iter().copied()).collect::<Vec<_>>())
    }

    /// The simulated robot's link.
    pub fn link(&self) -> SimLink {
        SimLink::connect(&self.address, 6).expect("the controller listens")
    }

    /// The hand that attaches the bar.
    pub fn hand(&self) -> SimHand {
        SimHand::connect(&self.address).expect("the controller listens")
    }

    /// Collects into a session with this link and operator, or by following the robot without a link.
    pub fn collect_with(
        &self,
        session: &str,
        link: Option<&mut dyn RobotLink>,
        operator: &mut dyn Operator,
        options: CollectOptions,
    ) -> Collected {
        self.collect_at(self.board.port(), session, link, operator, options)
    }

    /// As [`SimulatedCell::collect_with`], with the board at another port.
    pub fn collect_at(
        &self,
        port: &str,
        session: &str,
        link: Option<&mut dyn RobotLink>,
        operator: &mut dyn Operator,
        options: CollectOptions,
    ) -> Collected {
        let (design, rig) = (design(), rig());
        let rows = self.rows();
        let cell = Cell::new(&design, &rig, TRAVEL_M, Margins::default(), PlanPace::default()).expect("the rig is sound");
        let mut board = BoardLink::connect(port, BAUD).expect("the board answers");
        let (robot, _) = RobotOnBoard::read(&mut board).expect("the board answers").expect("it holds parameters");
        let run = Run::beginning("port", board.hello(), 200);
        let recorder = Recorder::begin(&self.path(session), run, Some(robot.kinds())).expect("the session can be written");
        let ledger = Ledger::new(&rows, recorder.measured_lines().into_iter(), recorder.skipped_lines().into_iter());
        let criteria = StillnessCriteria { hold_us: 200_000, ..StillnessCriteria::default() };
        let board = BoardWatch::begin(board, robot, recorder, 200, criteria).expect("the board streams");
        let mut collector = Collector::new(&cell, ledger, board, operator, options);
        let near = Nearness { turn_rad: 2_f64.to_radians(), slide_m: 2e-3 };
        let ended = match link {
            Some(link) => collector.drive(link),
            None => collector.follow(near, &Guide::Hand),
        };
        let (summary, ledger, closed) = collector.end();
        closed.expect("the session can be written");
        let states = (0..rows.len()).map(|row| ledger.state(row).clone()).collect();
        Collected { ended, summary, states, rows }
    }

    /// The plan's rows.
    pub fn rows(&self) -> Vec<PlanRow> {
        read_plan(&Source::new("plan.csv", &self.plan), &design(), &rig()).expect("a sound plan")
    }
}

/// A controller that listens; its address.
pub fn listen(driver: Driver, sigma_m: f64) -> String {
    let truth = Robot::open(TRUTH).expect("a built-in robot");
    let options = ControllerOptions { sigma_m, ..ControllerOptions::new(&truth, &rig()) };
    let controller = Controller::listen("127.0.0.1:0", driver, options).expect("a free port");
    controller.address().to_string()
}

/// What came of a collection.
pub struct Collected {
    /// How it ended.
    pub ended: Result<Ended, CollectError>,
    /// What came of it.
    pub summary: Summary,
    /// What became of every row.
    pub states: Vec<RowState>,
    /// The rows.
    pub rows: Vec<PlanRow>,
}

impl Collected {
    /// Rows of a state.
    pub fn count(&self, state: &RowState) -> usize {
        self.states.iter().filter(|other| *other == state).count()
    }
}

/// Options for a quick robot.
pub fn quick() -> CollectOptions {
    let speed = host_cal::robot_link::JointSpeed { revolute_rad_s: 90_f64.to_radians(), prismatic_m_s: 0.25 };
    CollectOptions { speed, free_speed: speed, patience: Duration::from_secs(5), ..CollectOptions::default() }
}

/// Values of a column of a session's poses, by name.
pub fn column(session: &Path, name: &str) -> Vec<String> {
    let Ok(text) = std::fs::read_to_string(session.join("poses.csv")) else { return Vec::new() };
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let at = header.iter().position(|column| *column == name).expect("the column is there");
    lines.map(|line| line.split(',').nth(at).unwrap_or_default().to_owned()).collect()
}
