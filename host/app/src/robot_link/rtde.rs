//! What a Universal Robots controller says of its robot: Real-Time Data Exchange, protocol version 2, port 30004.
//!
//! A package is its size (two bytes, high first, the three of this head included), its type (a letter) and its payload. The client
//! asks for the version, for the fields that it wants, and for the start; from then on the controller sends a data package in every
//! period.
//!
//! Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", and its Python client library
//! (UniversalRobots/RTDE_Python_Client_Library: rtde/rtde.py, rtde/serialize.py); values of the modes as in its C++ client library
//! (UniversalRobots/Universal_Robots_Client_Library: include/ur_client_library/ur/datatypes.h, rtde/data_package.h). How fast a program
//! goes is the product of `speed_scaling` and `target_speed_fraction`, and nothing while it is paused, as in UR's ROS driver
//! (UniversalRobots/Universal_Robots_ROS_scaled_controllers: speed_scaling_state_controller/README.md) and in ur_rtde
//! (`getSpeedScalingCombined`).

use std::time::Duration;

use super::LinkError;
use super::tcp::Tcp;
use crate::deadline::{StopFlag, WaitOver};

/// Joints of every UR.
pub(super) const JOINTS: usize = 6;
/// Data packages a second: what every controller can send; e-Series ones could send 500.
const RATE_HZ: f64 = 125.0;
/// Bytes before a payload.
const HEAD: usize = 3;
/// No package of the fields asked for, and no text, is longer.
const PACKAGE_MAX: usize = 1024;
const FIELDS: &str = "actual_q,actual_qd,target_q,robot_mode,safety_mode,runtime_state,speed_scaling,target_speed_fraction";
const FIELD_TYPES: &str = "VECTOR6D,VECTOR6D,VECTOR6D,INT32,INT32,UINT32,DOUBLE,DOUBLE";
/// Recipe, three vectors of six doubles, three words, two doubles.
const DATA_BYTES: usize = 1 + 3 * JOINTS * 8 + 3 * 4 + 2 * 8;

/// One data package.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RobotState {
    /// Where the joints are, radians.
    pub(super) q_rad: [f64; JOINTS],
    /// How fast they turn, radians per second.
    pub(super) qd_rad_s: [f64; JOINTS],
    /// Where the controller wants them, radians.
    pub(super) target_q_rad: [f64; JOINTS],
    pub(super) robot_mode: i32,
    pub(super) safety_mode: i32,
    pub(super) runtime_state: u32,
    /// By how much the trajectory limiter slows the robot down, from 0 to 1.
    pub(super) speed_scaling: f64,
    /// The speed slider, from 0 to 1.
    pub(super) target_speed_fraction: f64,
}

/// What is heard after the start.
pub(super) enum Heard {
    State(RobotState),
    /// A message for people.
    Text(String),
}

/// A connection that has been started.
pub(super) struct Rtde {
    tcp: Tcp,
    heard: Vec<u8>,
    recipe: u8,
}

impl RobotState {
    const RUNNING: i32 = 7;
    const NORMAL: i32 = 1;
    const REDUCED: i32 = 2;
    const PROTECTIVE_STOP: i32 = 3;
    const STOPPED: u32 = 1;
    const PLAYING: u32 = 2;
    const PAUSING: u32 = 3;
    const PAUSED: u32 = 4;
    /// A program goes on, if more slowly than this can be told from standing.
    const PACE_MIN: f64 = 1e-3;

    /// Why the robot cannot move now, in the controller's words; `None` when it can.
    pub(super) fn obstacle(&self) -> Option<String> {
        if ![Self::NORMAL, Self::REDUCED].contains(&self.safety_mode) {
            return Some(format!("safety mode {}", name(self.safety_mode, 0, &SAFETY_MODES)));
        }
        (self.robot_mode != Self::RUNNING).then(|| format!("robot mode {}", name(self.robot_mode, -1, &ROBOT_MODES)))
    }

    pub(super) fn is_in_protective_stop(&self) -> bool {
        self.safety_mode == Self::PROTECTIVE_STOP
    }

    /// Whether a program runs.
    pub(super) fn is_playing(&self) -> bool {
        self.runtime_state == Self::PLAYING
    }

    /// Whether none does.
    pub(super) fn is_stopped(&self) -> bool {
        self.runtime_state == Self::STOPPED
    }

    /// How fast a program goes, as a fraction of the speed that it asks for.
    pub(super) fn pace(&self) -> f64 {
        match self.runtime_state {
            Self::PAUSING | Self::PAUSED => 0.0,
            Self::PLAYING => (self.speed_scaling * self.target_speed_fraction).clamp(0.0, 1.0),
            _ => 1.0,
        }
    }

    /// What holds a program that runs, until somebody lets it go on; `None` when nothing does.
    pub(super) fn hold(&self) -> Option<&'static str> {
        match self.runtime_state {
            Self::PAUSING | Self::PAUSED => Some("the program is paused at the teach pendant"),
            _ if self.pace() >= Self::PACE_MIN => None,
            _ if self.target_speed_fraction < Self::PACE_MIN => Some("the speed slider is at 0"),
            _ => Some("the controller holds the robot back to speed 0 (speed_scaling)"),
        }
    }

    fn is_finite(&self) -> bool {
        let speeds = [self.speed_scaling, self.target_speed_fraction];
        let joints = [self.q_rad, self.qd_rad_s, self.target_q_rad];
        joints.iter().flatten().chain(&speeds).all(|value| value.is_finite())
    }
}

/// From 0. The RTDE guide ends with 11; the numbers from there on are the client library's, which has no 21.
const SAFETY_MODES: [&str; 23] = [
    "",
    "NORMAL",
    "REDUCED",
    "PROTECTIVE_STOP",
    "RECOVERY",
    "SAFEGUARD_STOP",
    "SYSTEM_EMERGENCY_STOP",
    "ROBOT_EMERGENCY_STOP",
    "VIOLATION",
    "FAULT",
    "VALIDATE_JOINT_ID",
    "UNDEFINED_SAFETY_MODE",
    "AUTOMATIC_MODE_SAFEGUARD_STOP",
    "SYSTEM_THREE_POSITION_ENABLING_STOP",
    "TP_THREE_POSITION_ENABLING_STOP",
    "IMMI_EMERGENCY_STOP",
    "IMMI_SAFEGUARD_STOP",
    "PROFISAFE_WAITING_FOR_PARAMETERS",
    "PROFISAFE_AUTOMATIC_MODE_SAFEGUARD_STOP",
    "PROFISAFE_SAFEGUARD_STOP",
    "PROFISAFE_EMERGENCY_STOP",
    "",
    "SAFETY_API_SAFEGUARD_STOP",
];

/// From -1.
const ROBOT_MODES: [&str; 10] = [
    "NO_CONTROLLER",
    "DISCONNECTED",
    "CONFIRM_SAFETY",
    "BOOTING",
    "POWER_OFF",
    "POWER_ON",
    "IDLE",
    "BACKDRIVE",
    "RUNNING",
    "UPDATING_FIRMWARE",
];

/// The name of a number, where the names begin at `first`.
fn name(number: i32, first: i32, names: &[&str]) -> String {
    let index = number.checked_sub(first).and_then(|index| usize::try_from(index).ok());
    let known = index.and_then(|index| names.get(index)).filter(|name| !name.is_empty());
    known.map_or_else(|| format!("number {number}"), |name| (*name).to_owned())
}

impl Rtde {
    /// Connects, agrees on version and fields, and starts the data packages.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn connect(host: &str, port: u16, wait: Duration) -> Result<Self, LinkError> {
        let mut rtde = Self { tcp: Tcp::connect(host, port, wait, &StopFlag::default())?, heard: Vec::new(), recipe: 0 };
        if rtde.ask(b'V', &2_u16.to_be_bytes(), wait)? != [1] {
            return Err(rtde.tcp.unexpected("no".into(), "yes to RTDE protocol version 2 (software 3.4 or newer)"));
        }
        let wanted = [RATE_HZ.to_be_bytes().as_slice(), FIELDS.as_bytes()].concat();
        let recipe = rtde.ask(b'O', &wanted, wait)?;
        match recipe.split_first() {
            Some((number, types)) if types == FIELD_TYPES.as_bytes() && *number != 0 => rtde.recipe = *number,
            _ => return Err(rtde.tcp.unexpected(readable(recipe.get(1..).unwrap_or_default()), FIELD_TYPES)),
        }
        if rtde.ask(b'S', &[], wait)? != [1] {
            return Err(rtde.tcp.unexpected("no".into(), "yes to the start of RTDE data"));
        }
        Ok(rtde)
    }

    /// The next that was heard, waiting a moment; `None` when nothing more is there.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn next(&mut self) -> Result<Option<Heard>, LinkError> {
        let Some((kind, payload)) = self.package()? else { return Ok(None) };
        let heard = match kind {
            b'U' => state(&payload, self.recipe).map(Heard::State),
            b'M' => text(&payload).map(Heard::Text),
            _ => None,
        };
        match heard {
            Some(heard) => Ok(Some(heard)),
            None => {
                let found = format!("package {} of {} bytes", readable(&[kind]), payload.len());
                Err(self.tcp.unexpected(found, "an RTDE data package of the fields asked for"))
            }
        }
    }

    /// Whether no part of a package is held.
    pub(super) fn is_between_packages(&self) -> bool {
        self.heard.is_empty()
    }

    /// Sends a request and gives the payload of its answer.
    fn ask(&mut self, kind: u8, payload: &[u8], wait: Duration) -> Result<Vec<u8>, LinkError> {
        // Every request is far shorter than 65,536 bytes.
        let size = (HEAD + payload.len()) as u16;
        self.tcp.write_all(&[&size.to_be_bytes(), &[kind][..], payload].concat())?;
        let deadline = self.tcp.deadline(wait);
        loop {
            match deadline.check() {
                Ok(()) => {}
                Err(WaitOver::Late) => return Err(self.tcp.unexpected("nothing".into(), "an answer to an RTDE request")),
                Err(WaitOver::Stopped) => return Err(LinkError::Stopped),
            }
            match self.package()? {
                Some((answer, payload)) if answer == kind => return Ok(payload),
                // What the controller tells people does not belong to the request.
                Some((b'M', _)) | None => {}
                Some((other, _)) => return Err(self.tcp.unexpected(readable(&[other]), "an answer to an RTDE request")),
            }
        }
    }

    /// Type and payload of the next package, `None` when it has not come whole yet.
    fn package(&mut self) -> Result<Option<(u8, Vec<u8>)>, LinkError> {
        if self.waiting_size()?.is_none() {
            let mut bytes = [0; PACKAGE_MAX];
            let count = self.tcp.read(&mut bytes)?;
            self.heard.extend_from_slice(&bytes[..count]);
        }
        let Some(size) = self.waiting_size()? else { return Ok(None) };
        let package: Vec<u8> = self.heard.drain(..size).collect();
        Ok(Some((package[HEAD - 1], package[HEAD..].to_vec())))
    }

    /// Size of the package that waits whole at the front. What is held never exceeds two packages.
    fn waiting_size(&self) -> Result<Option<usize>, LinkError> {
        let [high, low, ..] = self.heard[..] else { return Ok(None) };
        let size = usize::from(u16::from_be_bytes([high, low]));
        if (HEAD..=PACKAGE_MAX).contains(&size) {
            Ok((self.heard.len() >= size).then_some(size))
        } else {
            Err(self.tcp.unexpected(format!("a package of {size} bytes"), "RTDE"))
        }
    }
}

/// The fields of a data package; `None` when it is not of this recipe or size, or holds what is no number.
fn state(payload: &[u8], recipe: u8) -> Option<RobotState> {
    if payload.len() != DATA_BYTES || payload[0] != recipe {
        return None;
    }
    let word = |at: usize| <[u8; 4]>::try_from(&payload[at..at + 4]).ok();
    let double = |at: usize| Some(f64::from_be_bytes(<[u8; 8]>::try_from(&payload[at..at + 8]).ok()?));
    let vector = |at: usize| -> Option<[f64; JOINTS]> {
        let mut values = [0.0; JOINTS];
        for (value, bytes) in values.iter_mut().zip(payload[at..].chunks_exact(8)) {
            *value = f64::from_be_bytes(bytes.try_into().ok()?);
        }
        Some(values)
    };
    let words = 1 + 3 * JOINTS * 8;
    let state = RobotState {
        q_rad: vector(1)?,
        qd_rad_s: vector(1 + JOINTS * 8)?,
        target_q_rad: vector(1 + 2 * JOINTS * 8)?,
        robot_mode: i32::from_be_bytes(word(words)?),
        safety_mode: i32::from_be_bytes(word(words + 4)?),
        runtime_state: u32::from_be_bytes(word(words + 8)?),
        speed_scaling: double(words + 12)?,
        target_speed_fraction: double(words + 20)?,
    };
    state.is_finite().then_some(state)
}

/// A text message: length and text, length and source, level.
fn text(payload: &[u8]) -> Option<String> {
    let (length, rest) = payload.split_first()?;
    rest.get(..usize::from(*length)).map(readable)
}

/// Bytes as people may read them: no control characters.
fn readable(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).chars().filter(|character| !character.is_control()).collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn payload(value: f64) -> Vec<u8> {
        let words = [7_u32, 1, 2];
        let vectors = (0..3 * JOINTS).flat_map(|_| value.to_be_bytes());
        let speeds = [0.5_f64, 0.8].into_iter().flat_map(f64::to_be_bytes);
        [5].into_iter().chain(vectors).chain(words.into_iter().flat_map(u32::to_be_bytes)).chain(speeds).collect()
    }

    #[test]
    fn a_data_package_is_of_its_recipe_and_size_and_holds_numbers() {
        let robot = state(&payload(0.25), 5).unwrap();
        assert_eq!((robot.q_rad, robot.target_q_rad), ([0.25; JOINTS], [0.25; JOINTS]));
        assert!(robot.obstacle().is_none() && robot.is_playing());
        assert_eq!((robot.speed_scaling, robot.target_speed_fraction), (0.5, 0.8));
        assert_eq!(state(&payload(0.25), 6), None);
        assert_eq!(state(&payload(f64::NAN), 5), None);
        assert_eq!(state(&payload(0.25)[1..], 5), None);
        assert_eq!(state(&[payload(0.25), vec![0]].concat(), 5), None);
    }

    #[test]
    fn slider_and_limiter_multiply_and_a_pause_holds_all() {
        let with = |runtime_state, speed_scaling, target_speed_fraction| RobotState {
            runtime_state,
            speed_scaling,
            target_speed_fraction,
            ..state(&payload(0.0), 5).unwrap()
        };
        assert_eq!((with(2, 0.5, 0.8).pace(), with(2, 0.5, 0.8).hold()), (0.4, None));
        assert_eq!(with(2, 1.5, 1.0).pace(), 1.0, "no move is given less time than at the speed that was asked for");
        assert_eq!((with(4, 1.0, 1.0).pace(), with(3, 1.0, 1.0).pace()), (0.0, 0.0));
        assert!(with(4, 1.0, 1.0).hold().unwrap().contains("paused"));
        assert!(with(2, 1.0, 0.0).hold().unwrap().contains("speed slider"));
        assert!(with(2, 0.0, 1.0).hold().unwrap().contains("speed_scaling"));
        // Without a program there is nothing to slow down, whatever the fields say.
        assert_eq!((with(1, 0.0, 0.0).pace(), with(1, 0.0, 0.0).hold()), (1.0, None));
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..20_000 {
            let bytes: Vec<u8> = (0..rng.random_range(0..220)).map(|_| rng.random()).collect();
            let _ = (state(&bytes, 5), text(&bytes));
        }
        assert_eq!(text(&[3, b'a', b'b']), None);
        assert_eq!(text(&[2, b'a', 7, 0]), Some("a".into()));
    }

    #[test]
    fn every_mode_has_a_name() {
        let with = |robot_mode, safety_mode| {
            let mut robot = state(&payload(0.0), 5).unwrap();
            (robot.robot_mode, robot.safety_mode) = (robot_mode, safety_mode);
            robot.obstacle()
        };
        assert_eq!(with(7, 2), None);
        assert_eq!(with(3, 1).unwrap(), "robot mode POWER_OFF");
        let modes = [
            (3, "PROTECTIVE_STOP"),
            (4, "RECOVERY"),
            (5, "SAFEGUARD_STOP"),
            (6, "SYSTEM_EMERGENCY_STOP"),
            (7, "ROBOT_EMERGENCY_STOP"),
            (8, "VIOLATION"),
            (9, "FAULT"),
            (10, "VALIDATE_JOINT_ID"),
            (11, "UNDEFINED_SAFETY_MODE"),
            (12, "AUTOMATIC_MODE_SAFEGUARD_STOP"),
            (13, "SYSTEM_THREE_POSITION_ENABLING_STOP"),
            (14, "TP_THREE_POSITION_ENABLING_STOP"),
            (15, "IMMI_EMERGENCY_STOP"),
            (16, "IMMI_SAFEGUARD_STOP"),
            (17, "PROFISAFE_WAITING_FOR_PARAMETERS"),
            (18, "PROFISAFE_AUTOMATIC_MODE_SAFEGUARD_STOP"),
            (19, "PROFISAFE_SAFEGUARD_STOP"),
            (20, "PROFISAFE_EMERGENCY_STOP"),
            (22, "SAFETY_API_SAFEGUARD_STOP"),
        ];
        for (number, name) in modes {
            assert_eq!(with(7, number).unwrap(), format!("safety mode {name}"));
        }
        for number in [-1, 0, 21, 23] {
            assert_eq!(with(7, number).unwrap(), format!("safety mode number {number}"));
        }
        assert_eq!(with(7, i32::MIN).unwrap(), "safety mode number -2147483648");
        assert_eq!(with(i32::MAX, 1).unwrap(), "robot mode number 2147483647");
    }
}
