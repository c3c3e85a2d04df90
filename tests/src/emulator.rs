//! The real firmware image on an emulated Cortex-M4F: QEMU's `mps2-an386`, a simulated plant, and a serial port for the host.
//!
//! ```text
//! Plant ── PlantServer ══ socket ══ UART1 ┐
//!          (lockstep)                     ├ an386 in QEMU
//! host ═ PTY ═ Bridge ═══ socket ══ UART0 ┘
//! ```
//!
//! Time on the board is counted in instructions, so that a run does not depend on how fast this machine is: minutes of the robot
//! pass in seconds, and a host that is slow to read stops the board's time instead of losing anything.

mod images;
mod plant_server;
mod qemu;
mod record;

use std::path::Path;
use std::time::Duration;

use ballbar::{Chain, Measurement, Parameter};
use host_cal::virtual_board::{Driven, Plant, Script};
use tempfile::TempDir;

use crate::bridge::Bridge;

pub use images::{Image, is_skipped};
pub use plant_server::Tick;
pub use qemu::Qemu;

use plant_server::PlantServer;

/// A board that runs, with the robot it measures.
pub struct EmulatedBoard {
    // Dropped in this order: what talks to QEMU's sockets ends before they do.
    plant: PlantServer,
    bridge: Bridge,
    qemu: Qemu,
    _folder: TempDir,
}

/// For what takes the board a moment.
const LIMIT: Duration = Duration::from_secs(20);

impl EmulatedBoard {
    /// Powers a board up, with nothing in its flash.
    pub fn start(plant: Plant) -> Self {
        Self::start_driven(plant, None)
    }

    /// The same with somebody who drives the robot.
    pub fn start_driven(plant: Plant, driven: Option<Driven>) -> Self {
        let folder = tempfile::tempdir().expect("a folder for sockets");
        let qemu = Qemu::start(Image::An386.elf(), folder.path(), &[]);
        let bridge = Bridge::start(qemu.connect("link"));
        let plant = PlantServer::start(qemu.connect("plant"), plant, driven, bridge.watcher());
        qemu.go();
        Self { plant, bridge, qemu, _folder: folder }
    }

    /// The serial port that a host opens.
    pub fn port(&self) -> &str {
        self.bridge.port()
    }

    /// The line between the board and the host.
    pub fn line(&self) -> &Bridge {
        &self.bridge
    }

    /// Plays a script as soon as the board streams.
    pub fn play_with_stream(&self, script: Script) {
        self.plant.play_with_stream(script);
    }

    /// What the plant gave at every tick since the board's latest start, in order: the first before sampling began.
    pub fn ticks(&self) -> Vec<Tick> {
        self.plant.ticks()
    }

    /// The next answer of the plant is one that no plant gives.
    pub fn answer_nonsense(&self) {
        self.plant.answer_nonsense();
    }

    /// Presses the reset button, and waits until the board has started again.
    pub fn press_reset(&self) {
        let starts = self.plant.starts();
        self.qemu.command("system_reset");
        wait_for(LIMIT, "the board's start", || (self.plant.starts() > starts).then_some(()));
    }

    /// Resets that the firmware caused, the watchdog's included.
    pub fn own_resets(&self) -> usize {
        self.qemu.own_resets()
    }

    /// Waits until the firmware has reset itself so many times in all.
    pub fn wait_for_own_resets(&self, count: usize) {
        wait_for(LIMIT, &format!("reset {count} of the board"), || (self.own_resets() >= count).then_some(()));
    }
}

/// A six-axis robot and measured lengths as `firmware/src/bin/common/loaded.rs` reads them, for the programs that compute on the board. Free
/// are all parameters but those that move the tool as others do.
pub fn loaded(chain: &Chain<f64>, measurements: &[Measurement<f64>]) -> Vec<u8> {
    let free = (0..chain.parameter_count()).filter(|&index| !chain.is_conventionally_held(Parameter::from_index(index)));
    let bits = |values: &[f64]| -> Vec<u32> { values.iter().map(|&value| (value as f32).to_bits()).collect() };
    let mut words = bits(chain.parameters());
    words.extend(free.map(|index| index as u32));
    words.push(measurements.len() as u32);
    for Measurement { pairing, q, length_m, .. } in measurements {
        words.extend(bits(&q.as_array()[..chain.joints()]));
        words.extend([pairing.chuck_base_m, pairing.sphere_tool_m].iter().flat_map(|end| bits(end.as_slice())));
        words.extend(bits(&[*length_m]));
    }
    words.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// What a program of the emulated board prints on the link, up to a line `end`; `memory` stands at 0x21000000 beforehand.
pub fn output_of(image: Image, memory: &[u8]) -> String {
    use std::io::{BufRead, BufReader};

    let folder = tempfile::tempdir().expect("a folder for sockets");
    let file = folder.path().join("memory.bin");
    std::fs::write(&file, memory).expect("the memory's file can be written");
    let loader = format!("loader,addr=0x21000000,force-raw=on,file={}", path_text(&file));
    let qemu = Qemu::start(image.elf(), folder.path(), &["-device", &loader]);
    let link = qemu.connect("link");
    link.set_read_timeout(Some(Duration::from_secs(60))).expect("a socket takes a time limit");
    qemu.go();
    let mut text = String::new();
    let mut lines = BufReader::new(link);
    while !text.ends_with("end\n") {
        match lines.read_line(&mut text) {
            Ok(0) => panic!("QEMU ended; the program printed so far:\n{text}"),
            Ok(_) => {}
            Err(error) => panic!("{error} while waiting for the program's output; so far:\n{text}"),
        }
    }
    text.truncate(text.len() - "end\n".len());
    text
}

fn path_text(path: &Path) -> &str {
    path.to_str().expect("the temporary folder's name is text")
}

/// Looks again and again until there is something to see; a test fails with `what` was waited for when there is not.
pub fn wait_for<T>(limit: Duration, what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let began = std::time::Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(began.elapsed() < limit, "waited {limit:?} in vain for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}
