//! Six quadrature encoders on the six timers that can count them, and their index pulses.
//!
//! Written on the registers: stm32f4xx-hal's encoder driver knows neither 32-bit counters nor input filters.
//!
//! Counting: both edges of both channels (slave mode 3), so four counts a line.
//!
//! Input filter: a level counts once it stood for 8 samples at `f_DTS / 32`, which is 84 MHz / 32 = 2.625 MHz on all six timers
//! (TIM1 and TIM8 run at 168 MHz and divide by two). Pulses shorter than 7 / 2.625 MHz = 2.67 µs never count, levels of more than
//! 9 / 2.625 MHz = 3.43 µs always do, and counts come 3.05 to 3.43 µs late. A channel holds its level for two counts, hence at
//! most 583,000 counts a second from a perfect encoder; half of that, 290,000, leaves room for duty cycles and phases that are
//! off. The fastest joint of a PUMA 560 makes some 75,000 (at 6 rad/s).
//!
//! Skew: the counters are read one after the other with interrupts held off, in about 80 cycles of 168 MHz (four reads over APB1
//! at 42 MHz, two over APB2 at 84 MHz); [`SKEW_NS`] allows 100. An estimate from the instructions, not measured.
//!
//! Index pulses: the rising edge interrupts at the highest priority and the handler reads the counter, 0.5 µs after the edge when
//! nothing is in the way, 3.5 µs when all six come during a latch (estimates, likewise). The pin must still be high by then, so
//! that shorter glitches are no index, and an index that came while the processor stood still, waiting for the flash, is not
//! mistaken for one at the position where the robot is by now. The counters lag by their filter, the index does not: a joint of
//! 75,000 counts a second is 0.25 counts further than its counter.
//!
//! A line that rings would interrupt without end, above the sampling. So the handler masks a line that has interrupted, and the
//! next latch lets it in again: one interrupt a line and sampling period, at most 6 · 0.5 µs = 3 µs of the 200 µs at 5 kHz. What
//! else comes on that line meanwhile is not seen. Of a bouncing index that is the first edge, which is the true one; of two indices
//! in one period the first, which needs a turn of the encoder within it: 10 ms at the lowest rate.

#![allow(unsafe_code)] // the index handlers read timers that the sampler owns

use core::array;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use ballbar::CounterWidth;
use ballbar_firmware::{ENCODERS, EncoderBank, EncoderLatch};
use stm32f4xx_hal::pac::{EXTI, GPIOB, TIM1, TIM2, TIM3, TIM4, TIM5, TIM8};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

/// Time from the first counter's reading to the last, at most, nanoseconds: 100 cycles of 168 MHz.
pub(crate) const SKEW_NS: u32 = 600;

/// The timer of each joint. The 32-bit ones count the two joints of a PUMA 560 that span more than 16 bits.
pub(crate) struct EncoderTimers {
    pub(crate) j1: TIM1,
    pub(crate) j2: TIM3,
    pub(crate) j3: TIM4,
    pub(crate) j4: TIM2,
    pub(crate) j5: TIM8,
    pub(crate) j6: TIM5,
}

/// The counting timers, owned so that nobody else configures them.
pub(crate) struct Encoders {
    timers: EncoderTimers,
}

impl Encoders {
    /// Starts counting at zero.
    pub(crate) fn start(timers: EncoderTimers, rcc: &mut Rcc) -> Self {
        macro_rules! count {
            ($timer:ident: $type:ty, $dts_divider:ident, $last_count:expr) => {
                <$type>::enable(rcc);
                <$type>::reset(rcc);
                let timer = &timers.$timer;
                timer.ccmr1_input().write(|w| {
                    w.cc1s().ti1();
                    w.ic1f().fdts_div32_n8();
                    w.cc2s().ti2();
                    w.ic2f().fdts_div32_n8()
                });
                timer.smcr().write(|w| w.sms().encoder_mode_3());
                timer.arr().write(|w| w.arr().set($last_count));
                timer.cr1().write(|w| {
                    w.ckd().$dts_divider();
                    w.cen().enabled()
                });
            };
        }
        count!(j1: TIM1, div2, u16::MAX);
        count!(j2: TIM3, div1, u16::MAX);
        count!(j3: TIM4, div1, u16::MAX);
        count!(j4: TIM2, div1, u32::MAX);
        count!(j5: TIM8, div2, u16::MAX);
        count!(j6: TIM5, div1, u32::MAX);
        Self { timers }
    }

    /// Unmasks the index lines that have interrupted since the last latch.
    fn let_indices_in(&mut self) {
        // SAFETY: PR is written with ones to clear, and only those of masked lines, whose handlers are done with them; IMR is
        // written whole, in one access, and a handler that masks a line just before is merely overruled.
        let exti = unsafe { &*EXTI::ptr() };
        let masked = INDEX_LINES & !exti.imr().read().bits();
        // An edge of before, which a masked line may still have taken note of, is no index at what the counter shows by now.
        exti.pr().write(|w| unsafe { w.bits(masked) });
        exti.imr().write(|w| unsafe { w.bits(INDEX_LINES) });
    }
}

impl EncoderBank for Encoders {
    const WIDTHS: [CounterWidth; ENCODERS] = {
        use CounterWidth::{Bits16, Bits32};
        [Bits16, Bits16, Bits16, Bits32, Bits16, Bits32]
    };

    fn latch(&mut self) -> EncoderLatch {
        let at_index = array::from_fn(|joint| INDEX_CAPTURES[joint].take());
        self.let_indices_in();
        let timers = &self.timers;
        let counters = cortex_m::interrupt::free(|_| {
            [
                timers.j1.cnt().read().bits(),
                timers.j2.cnt().read().bits(),
                timers.j3.cnt().read().bits(),
                timers.j4.cnt().read().bits(),
                timers.j5.cnt().read().bits(),
                timers.j6.cnt().read().bits(),
            ]
        });
        EncoderLatch { counters, at_index }
    }
}

/// The pin of port B, and with it the EXTI line, of each joint's index.
const INDEX_PINS: [u8; ENCODERS] = [8, 9, 12, 13, 14, 15];

/// All index lines; nothing else uses the EXTI.
const INDEX_LINES: u32 = {
    let (mut lines, mut joint) = (0, 0);
    while joint < ENCODERS {
        lines |= 1 << INDEX_PINS[joint];
        joint += 1;
    }
    lines
};

static INDEX_CAPTURES: [IndexCapture; ENCODERS] = [const { IndexCapture::new() }; ENCODERS];

/// A counter's value handed from an index handler to the sampling interrupt, which the handler may interrupt at any point.
struct IndexCapture {
    fresh: AtomicBool,
    counter: AtomicU32,
}

impl IndexCapture {
    const fn new() -> Self {
        Self { fresh: AtomicBool::new(false), counter: AtomicU32::new(0) }
    }

    fn put(&self, counter: u32) {
        self.counter.store(counter, Ordering::Relaxed);
        self.fresh.store(true, Ordering::Release);
    }

    fn take(&self) -> Option<u32> {
        let mut taken = None;
        // Again when a pulse came between the two lines: its value was read already, and must not be reported twice.
        while self.fresh.swap(false, Ordering::Acquire) {
            taken = Some(self.counter.load(Ordering::Relaxed));
        }
        taken
    }
}

/// What an index handler does for the joints (from zero) of its interrupt.
pub(crate) fn capture_index_pulses<const JOINTS: usize>(joints: [usize; JOINTS]) {
    // SAFETY: PR is written with ones to clear, IDR only read, and IMR modified by these handlers alone, of which none interrupts
    // another; the latch, which they do interrupt, writes it in one access.
    let (exti, gpiob) = unsafe { (&*EXTI::ptr(), &*GPIOB::ptr()) };
    // A masked line may take note of edges, but none of them is an index.
    let pending = exti.pr().read().bits() & exti.imr().read().bits();
    let mut done = 0;
    for joint in joints {
        let line = 1 << INDEX_PINS[joint];
        if pending & line == 0 {
            continue;
        }
        let counter = counter(joint);
        if gpiob.idr().read().bits() & line != 0 {
            INDEX_CAPTURES[joint].put(counter);
        }
        done |= line;
    }
    // Masked first, so that no edge behind the clearing interrupts again.
    // SAFETY (both): bits of index lines; a one in PR clears that line and leaves the others alone.
    exti.imr().modify(|r, w| unsafe { w.bits(r.bits() & !done) });
    exti.pr().write(|w| unsafe { w.bits(done) });
}

/// The counter of a joint (from zero) as it stands.
fn counter(joint: usize) -> u32 {
    // SAFETY: reading a counter changes nothing, and the timers run before the index interrupts are let in.
    unsafe {
        match joint {
            0 => (*TIM1::ptr()).cnt().read().bits(),
            1 => (*TIM3::ptr()).cnt().read().bits(),
            2 => (*TIM4::ptr()).cnt().read().bits(),
            3 => (*TIM2::ptr()).cnt().read().bits(),
            4 => (*TIM8::ptr()).cnt().read().bits(),
            _ => (*TIM5::ptr()).cnt().read().bits(),
        }
    }
}
