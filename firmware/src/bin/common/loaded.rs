//! What the programs that compute on the emulated board have in common: numbers that its loader puts into the PSRAM, and lines that they
//! print on the link.

use core::fmt::{self, Write};
use core::panic::PanicInfo;

use ballbar::{JointVector, Measurement, Pairing, Vector3};

use crate::pac::{FREE_TIMER, LINK_UART};

/// The most lengths that are loaded.
pub(crate) const MOST_POSES: usize = 810;
/// Parameters of a robot with six joints.
pub(crate) const PARAMETERS: usize = 54;
/// Of these, free in a fit.
pub(crate) const FREE: usize = 36;

/// Instructions for each count of the timer, where an instruction takes a nanosecond (`-icount shift=0`).
pub(crate) const INSTRUCTIONS_PER_COUNT: u32 = 1_000_000_000 / crate::pac::CLOCK_HZ;

/// A robot, and lengths measured with it: numbers of 32 bits, low byte first.
#[repr(C)]
pub(crate) struct Inputs {
    /// The chain's parameters, metres, radians and ones.
    pub(crate) parameters: [f32; PARAMETERS],
    /// Indices of the free ones, ascending.
    pub(crate) free: [u32; FREE],
    count: u32,
    poses: [MeasuredPose; MOST_POSES],
}

#[repr(C)]
struct MeasuredPose {
    q_rad: [f32; 6],
    chuck_base_m: [f32; 3],
    sphere_tool_m: [f32; 3],
    length_m: f32,
}

impl Inputs {
    /// The lengths.
    pub(crate) fn measurements(&self) -> impl Iterator<Item = Measurement<f32>> + Clone + '_ {
        self.poses.iter().take(self.count as usize).map(MeasuredPose::measurement)
    }
}

impl MeasuredPose {
    fn measurement(&self) -> Measurement<f32> {
        let mut q = JointVector::zero();
        q.as_array_mut()[..self.q_rad.len()].copy_from_slice(&self.q_rad);
        let (chuck_base_m, sphere_tool_m) = (Vector3::from(self.chuck_base_m), Vector3::from(self.sphere_tool_m));
        Measurement::new(Pairing { chuck_base_m, sphere_tool_m }, q, self.length_m)
    }
}

/// What was loaded.
pub(crate) fn inputs() -> &'static Inputs {
    const PSRAM: usize = 0x2100_0000;
    // SAFETY: memory of the board that the linker uses for nothing, and any bits in it are numbers.
    #[expect(unsafe_code, reason = "the loader's memory is known to nobody but it and this")]
    unsafe {
        &*(PSRAM as *const Inputs)
    }
}

/// Makes timer and link ready.
pub(crate) fn start() {
    FREE_TIMER.start_free();
    LINK_UART.start(false);
}

/// Prints a line.
pub(crate) fn say(line: fmt::Arguments<'_>) {
    let _ = writeln!(Printer, "{line}");
}

/// Prints the last line and waits for ever.
pub(crate) fn end() -> ! {
    say(format_args!("end"));
    loop {
        cortex_m::asm::wfi();
    }
}

struct Printer;

impl Write for Printer {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(|byte| LINK_UART.write(byte));
        Ok(())
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    say(format_args!("{info}"));
    end()
}
