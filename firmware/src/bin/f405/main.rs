//! The firmware of the real board, an STM32F405RG: it gives the board's hardware to the portable library and does nothing else.
//!
//! The sampling interrupt runs [`Sampler::tick`] and nothing beside it; above it there are only the index pulses, whose counters
//! must be read at once, and below it the serial link's transmission and the main loop. `docs/board.md` has the wiring and the
//! timing.
#![no_std]
#![no_main]

mod board;
mod boot;
mod clock;
#[path = "../common/crash.rs"]
mod crash;
mod encoders;
mod flash;
mod link;
mod lvdt;
mod pins;
mod reset;
mod sampling;

use defmt_rtt as _;

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use ballbar_firmware::{Board, SampleQueue, Sampler};

    use crate::board::F405;
    use crate::clock::Clock;
    use crate::encoders::{self, EncoderTimers, Encoders};
    use crate::flash::SlotFlash;
    use crate::link::{SerialLink, Transmitter};
    use crate::lvdt::Lvdt;
    use crate::pins::{self, Ports};
    use crate::reset;
    use crate::sampling::{self, SamplingTimer};

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        sampler: Sampler<'static, Encoders, Lvdt, Clock>,
        transmitter: Transmitter,
        board: Board<'static, F405>,
    }

    #[init(local = [samples: SampleQueue = SampleQueue::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let device = cx.device;
        let reset_reason = reset::take_reason(&device.RCC);
        // Before the crystal is waited for, so that a dead crystal is a row of resets and not a silence.
        let watchdog = reset::start_watchdog(device.IWDG, &device.DBGMCU);
        let mut rcc = reset::start_clocks(device.RCC);

        let lamp = pins::configure(
            Ports { gpioa: device.GPIOA, gpiob: device.GPIOB, gpioc: device.GPIOC, syscfg: device.SYSCFG, exti: device.EXTI },
            &mut rcc,
        );
        let timers = EncoderTimers {
            j1: device.TIM1,
            j2: device.TIM3,
            j3: device.TIM4,
            j4: device.TIM2,
            j5: device.TIM8,
            j6: device.TIM5,
        };
        let encoders = Encoders::start(timers, &mut rcc);
        let lvdt = Lvdt::start(device.ADC1, &device.ADC_COMMON, device.DMA2, &mut rcc);
        let clock = Clock::start(cx.core.SYST);
        let (link, transmitter) = SerialLink::start(device.USART2, device.DMA1, &mut rcc);
        let timer = SamplingTimer::start(device.TIM7, &mut rcc);

        let (producer, consumer) = cx.local.samples.split();
        let hardware = F405::new(link, SlotFlash::new(device.FLASH), lamp, timer, watchdog);
        let local = Local {
            sampler: Sampler::new(encoders, lvdt, clock, producer),
            transmitter,
            board: Board::new(hardware, consumer, reset_reason),
        };
        (Shared {}, local)
    }

    #[idle(local = [board])]
    fn idle(cx: idle::Context) -> ! {
        loop {
            cx.local.board.poll();
            // The sampling interrupt ends the sleep, at least a hundred times a second. A core at rest also disturbs the
            // converter less (AN4073).
            cortex_m::asm::wfi();
        }
    }

    #[task(binds = TIM7, priority = 3, local = [sampler])]
    fn sample(cx: sample::Context) {
        sampling::acknowledge();
        cx.local.sampler.tick();
    }

    #[task(binds = EXTI9_5, priority = 4)]
    fn index_of_joints_1_and_2(_: index_of_joints_1_and_2::Context) {
        encoders::capture_index_pulses([0, 1]);
    }

    #[task(binds = EXTI15_10, priority = 4)]
    fn index_of_joints_3_to_6(_: index_of_joints_3_to_6::Context) {
        encoders::capture_index_pulses([2, 3, 4, 5]);
    }

    #[task(binds = DMA1_STREAM6, priority = 1, local = [transmitter])]
    fn transmit(cx: transmit::Context) {
        cx.local.transmitter.advance();
    }
}
