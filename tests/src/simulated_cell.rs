//! A robot at its rig, all simulated: the virtual board, the controller that moves the robot, and plans for it.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::Duration;

use ballbar::StillnessCriteria;
use ballbar_calib::model::{PairingId, Rig, Robot};
use ballbar_calib::plan::{Cell, CheckedPlan, Grid, Margins, Pace as PlanPace, PlanOptions, PlanRow, plan};
use host_cal::board::{BAUD, BoardLink, parameter_set};
use host_cal::collect::{
    BoardWatch, CheckedBoard, CollectError, CollectOptions, Collector, Ended, Guide, Ledger, Nearness, Operator, RowState,
    Summary,
};
use host_cal::files::{Source, open_rig, open_robot, read_plan, write_plan};
use host_cal::robot_link::RobotLink;
use host_cal::robot_link::sim::{SimHand, SimLink};
use host_cal::session::{Recorder, Run, SessionLock};
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

/// The link to the board's port, in the cell's folder.
const PORT: &str = "port";
/// A quick robot, whose arm counts as standing after a fifth of a second.
const QUICK: [&str; 6] = ["--speed-deg-s", "90", "--rate", "200", "--hold-ms", "200"];

/// A short plan: three pairings, eight poses each, one bar. Its text.
pub static SHORT_PLAN: LazyLock<String> = LazyLock::new(|| plan_text(8, &[0.46], &[(0, 0), (1, 1), (2, 2)]));

/// How many poses a plan's text has to measure.
pub fn poses_of(plan: &str) -> usize {
    plan.lines().filter(|line| line.starts_with("measure,")).count()
}

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
    open_robot(DESIGN).expect("a built-in robot")
}

/// The rig.
pub fn rig() -> Rig {
    open_rig(RIG).expect("a built-in rig")
}

/// The robot as it is.
pub fn truth() -> Robot {
    open_robot(TRUTH).expect("a built-in robot")
}

/// A plant of the true robot.
pub fn plant(seed: u64) -> Plant {
    Plant::new(&truth(), TRAVEL_M, seed).expect("its encoders are known")
}

/// A board that is ready, with the robot's controller.
pub struct SimulatedCell<Board = VirtualBoard> {
    /// Holds the sessions, and the link `port` to the board's.
    pub folder: TempDir,
    /// The board.
    pub board: Board,
    /// The controller's address.
    pub address: String,
    /// The plan.
    pub plan: String,
}

impl SimulatedCell {
    /// With a plant, the play of the bar's ends (standard deviation, metres), and a plan's text.
    pub fn start(plant: Plant, sigma_m: f64, plan: &str) -> Self {
        Self::with_controller(plant, ControllerOptions { sigma_m, ..controller() }, plan)
    }

    /// With a plant, a controller for it, and a plan's text.
    pub fn with_controller(plant: Plant, controller: ControllerOptions, plan: &str) -> Self {
        let (driver, driven) = driver();
        let address = listen(driver, controller);
        Self::with_address(plant, Some(driven), address, plan)
    }

    /// With whoever holds the other end of `driven`, and no controller.
    pub fn driven_by_hand(plant: Plant, driven: Driven, plan: &str) -> Self {
        Self::with_address(plant, Some(driven), String::new(), plan)
    }

    fn with_address(plant: Plant, driven: Option<Driven>, address: String, plan: &str) -> Self {
        let folder = folder_with(plan);
        let parameters = Some(parameter_set(&design(), plant.lvdt()).expect("the robot fits a board"));
        let port_name = Some(folder.path().join(PORT));
        let options =
            VirtualBoardOptions { parameters, is_homed: true, driven, port_name, ..VirtualBoardOptions::new(plant, Pace::Free) };
        let board = VirtualBoard::start(options).expect("the board starts");
        Self { folder, board, address, plan: plan.to_owned() }
    }
}

impl<Board> SimulatedCell<Board> {
    /// Around a board at a port, whose robot the controller at an address moves.
    pub fn around(board: Board, port: &str, address: String, plan: &str) -> Self {
        let folder = folder_with(plan);
        std::os::unix::fs::symlink(port, folder.path().join(PORT)).expect("a link can be made");
        Self { folder, board, address, plan: plan.to_owned() }
    }

    /// A file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Arguments of `host-cal collect` into a session, with a quick robot.
    pub fn collect_args(&self, session: &str) -> Vec<String> {
        self.collect_args_with(session, &QUICK)
    }

    fn collect_args_with(&self, session: &str, more: &[&str]) -> Vec<String> {
        let words = ["collect", PORT, "--session", session, "--plan", "plan.csv", "--robot", DESIGN, "--rig", RIG];
        let link = ["--robot-link", "sim", "--robot-address", &self.address];
        [&words[..], &link, more].concat().into_iter().map(str::to_owned).collect()
    }

    /// Runs `host-cal` in the folder.
    pub fn host_cal(&self, args: &[&str]) -> CommandRun {
        host_cal_in(self.folder.path(), args)
    }

    /// Runs `host-cal collect` with a quick robot.
    pub fn collect(&self, session: &str, more: &[&str]) -> CommandRun {
        self.collect_as(session, &[&QUICK, more].concat())
    }

    /// Runs `host-cal collect` with these arguments beside those that say what and where.
    pub fn collect_as(&self, session: &str, more: &[&str]) -> CommandRun {
        let args = self.collect_args_with(session, more);
        self.host_cal(&args.iter().map(String::as_str).collect::<Vec<_>>())
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
        self.collect_at(&self.path(PORT).display().to_string(), session, link, operator, options)
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
        let board = BoardLink::connect(port, BAUD).expect("the board answers");
        let board = CheckedBoard::read(board, &design).expect("it is homed, with the plan's robot");
        let run = Run::beginning("port", board.link().hello(), 200);
        let lock = SessionLock::acquire(&self.path(session)).expect("nobody else writes");
        let recorder = Recorder::begin(&lock, run, Some(board.robot().kinds())).expect("the session can be written");
        let plan = CheckedPlan::new(&cell, &rows).expect("a plan that leads into nothing");
        let ledger = Ledger::new(plan, recorder.measured_lines().into_iter(), recorder.skipped_lines().into_iter());
        let criteria = StillnessCriteria { hold_us: 200_000, ..StillnessCriteria::default() };
        let board = BoardWatch::begin(board, recorder, 200, criteria).expect("the board streams");
        let mut collector = Collector::new(ledger, board, operator, options);
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

    /// Every row of the plan that is to be measured is in the session once.
    pub fn assert_all_measured(&self, session: &str) {
        let mut lines: Vec<usize> =
            column(&self.path(session), "plan_row").iter().map(|line| line.parse().expect("a line of the plan")).collect();
        lines.sort_unstable();
        let rows = self.plan.lines().enumerate();
        let expected: Vec<usize> = rows.filter(|(_, line)| line.starts_with("measure")).map(|(i, _)| i + 1).collect();
        assert_eq!(lines, expected);
    }

    /// The plan's rows.
    pub fn rows(&self) -> Vec<PlanRow> {
        read_plan(&Source::new("plan.csv", &self.plan), &design(), &rig()).expect("a sound plan")
    }
}

fn folder_with(plan: &str) -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    std::fs::write(folder.path().join("plan.csv"), plan).expect("the plan can be written");
    folder
}

/// The true robot's controller, without noise of its own.
pub fn controller() -> ControllerOptions {
    ControllerOptions::new(&truth(), &rig())
}

/// A controller that listens; its address.
pub fn listen(driver: Driver, options: ControllerOptions) -> String {
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
