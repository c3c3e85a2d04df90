//! The firmware of the emulated board, Arm's MPS2 AN386 in QEMU: the library of the real board on registers that an emulator has.
//!
//! The sampling interrupt exchanges each tick with a simulated plant over UART1 and waits for it, so that the plant's time and the
//! board's are the same; the link to the host is UART0. `tests/src/emulator.rs` is the other end of both.
#![no_std]
#![no_main]

mod board;
#[path = "../common/crash.rs"]
mod crash;
mod pac;
mod plant_link;
mod record;
mod reset;
mod sampling;
mod serial;
mod stack;

use defmt_rtt as _;

#[rtic::app(device = crate::pac, peripherals = false)]
mod app {
    use ballbar_firmware::{Board, SampleQueue, Sampler};

    use crate::board::An386;
    use crate::pac::FREE_TIMER;
    use crate::plant_link::{LatchClock, PlantEncoders, PlantLvdt};
    use crate::sampling::SamplingTimer;
    use crate::serial::{ReceivedBytes, Receiver, SerialLink};
    use crate::{reset, stack};

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        timer: SamplingTimer,
        sampler: Sampler<'static, PlantEncoders, PlantLvdt, LatchClock>,
        receiver: Receiver,
        board: Board<'static, An386>,
    }

    #[init(local = [samples: SampleQueue = SampleQueue::new(), bytes: ReceivedBytes = ReceivedBytes::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        stack::guard(&cx.core.MPU);
        let reset_reason = reset::take_reason();
        let watchdog = reset::start_watchdog();
        FREE_TIMER.start_free();

        let (producer, consumer) = cx.local.samples.split();
        let sampler = Sampler::new(PlantEncoders::start(), PlantLvdt::default(), LatchClock::default(), producer);
        let (link, receiver) = SerialLink::start(cx.local.bytes);
        let hardware = An386::new(link, watchdog, &reset_reason);
        let board = Board::new(hardware, consumer, reset_reason);
        (Shared {}, Local { timer: SamplingTimer::start(), sampler, receiver, board })
    }

    #[idle(local = [board])]
    fn idle(cx: idle::Context) -> ! {
        loop {
            cx.local.board.poll();
            // The sampling interrupt ends the sleep, at least a hundred times a second.
            cortex_m::asm::wfi();
        }
    }

    #[task(binds = TIMER0, priority = 3, local = [timer, sampler])]
    fn sample(cx: sample::Context) {
        cx.local.timer.acknowledge();
        cx.local.sampler.tick();
    }

    #[task(binds = UART0_RX, priority = 2, local = [receiver])]
    fn receive(cx: receive::Context) {
        cx.local.receiver.take();
    }
}
