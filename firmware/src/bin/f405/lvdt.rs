//! The LVDT's conditioner on ADC1: sixteen conversions a scan, moved by DMA2 stream 0.
//!
//! A scan alternates between PC0 (channel 10), the conditioner's output, and PC1 (channel 11), its reference at half scale. What
//! both carry, an offset of the converter or of its ground, drops out of the difference of the sums.
//!
//! Scale: `code = 32768 + 2 · (ΣPC0 − ΣPC1)` over eight conversions of each. With the reference at half of VDDA the code runs
//! from 0 to 65,520; one step is 1/16 of a 12-bit step, 50 µV of 3.3 V. A reference off half scale moves the range, and a code
//! beyond 16 bits is held at the end and marked as saturated.
//!
//! Noise: the datasheet gives no figure for the noise of one conversion. With 1 step of 12 bits RMS each, the sums of 8 and 8
//! have √16 steps and the code 8 (0.4 mV, or 1.2e-4 of full scale); the averages of the settling detection take it down further.
//! Quantisation alone, with that much noise to dither it, adds 8 · 0.29 = 2.3. Estimates, not measured.
//!
//! Timing: PCLK2 84 MHz / 4 = 21 MHz (at most 36 MHz for VDDA from 2.4 V). 15 cycles of sampling (0.71 µs) and 12 of conversion
//! are 27 cycles or 1.29 µs each, 20.6 µs a scan, against 200 µs between samples at the highest rate. The sampling capacitor (4
//! pF, behind at most 6 kΩ) settles within 24 ns · ln(2¹⁴) = 0.23 µs from a source of no impedance, which the capacitor at the
//! pin is to it (`docs/board.md`).
//!
//! Start: by software, from the sampling interrupt. TIM1 to TIM5 and TIM8 are the only timers that can trigger ADC1, and all of
//! them count encoders. The interrupt's jitter therefore moves scan and latch together, and their distance stays.
//!
//! The converter has no self-calibration (its gain and offset are trimmed in the factory); what is left of its errors is part of
//! the LVDT's polynomial, which is found with the converter in place. Full scale is VDDA, so the supply's drift is gain.

#![allow(unsafe_code)] // a DMA stream writes memory, and the sequence's registers take raw channel numbers

use core::sync::atomic::{AtomicU16, Ordering, fence};

use ballbar_firmware::{LvdtScan, TriggeredAdc};
use stm32f4xx_hal::dma::config::Priority;
use stm32f4xx_hal::dma::traits::{Stream, StreamISR};
use stm32f4xx_hal::dma::{DmaChannel, DmaDataSize, DmaDirection, StreamX, StreamsTuple};
use stm32f4xx_hal::pac::{ADC_COMMON, ADC1, DMA2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Enable, Rcc};

const CONVERSIONS: u16 = 16;
const SIGNAL_CHANNEL: u8 = 10;
const REFERENCE_CHANNEL: u8 = 11;
const LAST_STEP: i32 = 4095;

/// Time from the latch of the encoders to the middle of the signal's conversions, nanoseconds.
pub(crate) const DELAY_NS: u32 = {
    const ADC_CLOCK_MHZ: u32 = 21;
    const SAMPLING_CYCLES: u32 = 15;
    const CONVERSION_CYCLES: u32 = SAMPLING_CYCLES + 12;
    // A conversion holds the voltage of the end of its sampling. Those of the signal are number 0, 2, .. 14: 7 on average.
    const MEAN_HOLD_CYCLES: u32 = 7 * CONVERSION_CYCLES + SAMPLING_CYCLES;
    // From the middle of the latch to the start, some 420 cycles of 168 MHz: estimated from the instructions, not measured.
    const START_AFTER_LATCH_NS: u32 = 2_500;
    MEAN_HOLD_CYCLES * 1_000 / ADC_CLOCK_MHZ + START_AFTER_LATCH_NS
};

/// Where the DMA puts a scan. Atomic, because it writes behind the compiler's back.
static CONVERTED: [AtomicU16; CONVERSIONS as usize] = [const { AtomicU16::new(0) }; CONVERSIONS as usize];

/// The converter and the DMA stream that empties it.
pub(crate) struct Lvdt {
    adc: ADC1,
    stream: StreamX<DMA2, 0>,
    running: bool,
}

impl Lvdt {
    /// Switches the converter on; it is ready 3 µs later.
    pub(crate) fn start(adc: ADC1, common: &ADC_COMMON, dma: DMA2, rcc: &mut Rcc) -> Self {
        ADC1::enable(rcc);
        common.ccr().modify(|_, w| w.adcpre().div4());
        adc.smpr1().write(|w| {
            w.smp10().cycles15();
            w.smp11().cycles15()
        });
        adc.cr1().write(|w| {
            w.scan().enabled();
            w.res().twelve_bit()
        });
        set_sequence(&adc);
        adc.cr2().write(|w| w.adon().enabled());

        let mut stream = StreamsTuple::new(dma, rcc).0;
        stream.set_channel(DmaChannel::Channel0);
        stream.set_direction(DmaDirection::PeripheralToMemory);
        stream.set_priority(Priority::VeryHigh);
        stream.set_peripheral_address(adc.dr().as_ptr() as u32);
        stream.set_memory_address(CONVERTED.as_ptr() as u32);
        stream.set_memory_increment(true);
        // SAFETY: both the converter's data register and `CONVERTED` are of half-words.
        unsafe {
            stream.set_peripheral_size(DmaDataSize::HalfWord);
            stream.set_memory_size(DmaDataSize::HalfWord);
        }
        Self { adc, stream, running: false }
    }

    /// Stops everything; the next start begins with switching the converter on.
    fn abort(&mut self) {
        // SAFETY: what the stream has not written yet stays as it was.
        unsafe { self.stream.disable() };
        self.adc.cr2().write(|w| w.adon().disabled());
        self.running = false;
    }
}

impl TriggeredAdc for Lvdt {
    fn start(&mut self) {
        if self.stream.is_enabled() {
            return; // still ends what was aborted
        }
        if self.adc.cr2().read().adon().is_disabled() {
            self.adc.cr2().write(|w| w.adon().enabled());
            return; // must settle for 3 µs first, so the next tick is the first that can start
        }
        self.stream.clear_all_flags();
        self.adc.sr().write(|w| w.ovr().clear());
        self.stream.set_number_of_transfers(CONVERSIONS);
        // SAFETY: it writes the `CONVERSIONS` half-words of `CONVERTED`, which are atomic and live for ever.
        unsafe { self.stream.enable() };
        // The converter asks for its DMA again only after this bit was low.
        self.adc.cr2().write(|w| w.adon().enabled());
        self.adc.cr2().write(|w| {
            w.adon().enabled();
            w.dma().enabled();
            w.swstart().start()
        });
        self.running = true;
    }

    fn finish(&mut self) -> Option<LvdtScan> {
        if !self.running {
            return None;
        }
        if !self.stream.is_transfer_complete() || self.adc.sr().read().ovr().is_overrun() {
            self.abort();
            return None;
        }
        self.running = false;
        fence(Ordering::Acquire); // what the DMA wrote is read after its flag
        Some(scan(&CONVERTED))
    }
}

/// Sums a scan's conversions; the even ones are the signal's.
fn scan(converted: &[AtomicU16]) -> LvdtScan {
    let mut difference = 0;
    // Negative once a step stood at 0 or at the last one: no branch, as this delays the start of the next scan.
    let mut inside = 0;
    for pair in converted.chunks_exact(2) {
        let [signal, reference] = [&pair[0], &pair[1]].map(|step| i32::from(step.load(Ordering::Relaxed)));
        difference += signal - reference;
        inside |= (signal - 1) | (LAST_STEP - 1 - signal) | (reference - 1) | (LAST_STEP - 1 - reference);
    }
    let code = 32_768 + 2 * difference;
    let held = code.clamp(0, i32::from(u16::MAX));
    LvdtScan { code: held as u16, saturated: inside < 0 || held != code }
}

/// Signal, reference, signal, and so on.
fn set_sequence(adc: &ADC1) {
    let channel = |conversion: u8| if conversion.is_multiple_of(2) { SIGNAL_CHANNEL } else { REFERENCE_CHANNEL };
    // SAFETY (all three): the five bits of each place take any channel, and 10 and 11 exist.
    adc.sqr3().write(|w| {
        for place in 0..6 {
            unsafe { w.sq(place).bits(channel(place)) };
        }
        w
    });
    adc.sqr2().write(|w| {
        for place in 0..6 {
            unsafe { w.sq(place).bits(channel(6 + place)) };
        }
        w
    });
    adc.sqr1().write(|w| {
        for place in 0..4 {
            unsafe { w.sq(place).bits(channel(12 + place)) };
        }
        w.l().set(CONVERSIONS as u8 - 1)
    });
}
