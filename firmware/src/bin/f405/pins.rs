//! What each pin does. The table in `docs/board.md` lists them by number.

use stm32f4xx_hal::gpio::{Edge, ExtiPin, Output, PC9, Pull, Speed};
use stm32f4xx_hal::pac::{EXTI, GPIOA, GPIOB, GPIOC, SYSCFG};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;

/// The board's lamp: a light-emitting diode from PC9 to ground, so that high is on.
pub(crate) type Lamp = PC9<Output>;

/// The peripherals that pins are configured by.
pub(crate) struct Ports {
    pub(crate) gpioa: GPIOA,
    pub(crate) gpiob: GPIOB,
    pub(crate) gpioc: GPIOC,
    pub(crate) syscfg: SYSCFG,
    pub(crate) exti: EXTI,
}

/// Gives every pin its function, for good; returns the only one that the program drives by itself.
pub(crate) fn configure(mut ports: Ports, rcc: &mut Rcc) -> Lamp {
    let a = ports.gpioa.split(rcc);
    let b = ports.gpiob.split(rcc);
    let c = ports.gpioc.split(rcc);
    let mut syscfg = ports.syscfg.constrain(rcc);

    // A receiver that is not fitted leaves its pins open: the pull keeps them from counting noise.
    a.pa8.into_alternate::<1>().set_internal_resistor(Pull::Up); // J1: TIM1
    a.pa9.into_alternate::<1>().set_internal_resistor(Pull::Up);
    a.pa6.into_alternate::<2>().set_internal_resistor(Pull::Up); // J2: TIM3
    a.pa7.into_alternate::<2>().set_internal_resistor(Pull::Up);
    b.pb6.into_alternate::<2>().set_internal_resistor(Pull::Up); // J3: TIM4
    b.pb7.into_alternate::<2>().set_internal_resistor(Pull::Up);
    a.pa15.into_alternate::<1>().set_internal_resistor(Pull::Up); // J4: TIM2; these two were JTDI and JTDO
    b.pb3.into_alternate::<1>().set_internal_resistor(Pull::Up);
    c.pc6.into_alternate::<3>().set_internal_resistor(Pull::Up); // J5: TIM8
    c.pc7.into_alternate::<3>().set_internal_resistor(Pull::Up);
    a.pa0.into_alternate::<2>().set_internal_resistor(Pull::Up); // J6: TIM5
    a.pa1.into_alternate::<2>().set_internal_resistor(Pull::Up);

    macro_rules! interrupt_on_rising_edge {
        ($($pin:expr),+) => {$(
            let mut pin = $pin.into_pull_down_input();
            pin.make_interrupt_source(&mut syscfg);
            pin.trigger_on_edge(&mut ports.exti, Edge::Rising);
            pin.enable_interrupt(&mut ports.exti);
        )+};
    }
    interrupt_on_rising_edge!(b.pb8, b.pb9, b.pb12, b.pb13, b.pb14, b.pb15);

    c.pc0.into_analog(); // the conditioner's output
    c.pc1.into_analog(); // its reference at half scale
    c.pc2.into_analog(); // the pair of a second conditioner, not sampled
    c.pc3.into_analog();

    a.pa2.into_alternate::<7>().set_speed(Speed::Medium);
    a.pa3.into_alternate::<7>().set_internal_resistor(Pull::Up); // an unplugged line is to look idle

    c.pc9.into_push_pull_output()
}
