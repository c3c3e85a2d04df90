//! The serial link to the host: USART2 on PA2 and PA3, 921,600 baud, 8N1, with DMA both ways.
//!
//! Baud rate: 42 MHz / 46 = 913,043, which is 0.93 % below 921,600 and the nearest that the bus clock divides to. A receiver
//! takes 3.3 % or more in all; an adapter that is exact itself samples the last bit 9 % of a bit late.
//!
//! Receiving: DMA1 stream 5 fills a ring for ever. The ring holds 22 ms of an unbroken stream; bytes that nobody read by then are
//! written over, and the frames' checksums notice. That covers the longest sleep of the main loop, 10 ms, but not an erase of the
//! flash (0.5 s): the host waits for the answer that follows it.
//!
//! Transmitting: the main loop puts bytes into a ring and raises the interrupt of DMA1 stream 6; the interrupt alone moves the
//! ring to the wire, piece after piece. Each index has one writer, so neither side ever waits for the other.

#![allow(unsafe_code)] // DMA streams read and write memory

use core::convert::Infallible;
use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering, fence};

use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use stm32f4xx_hal::dma::config::Priority;
use stm32f4xx_hal::dma::traits::Stream;
use stm32f4xx_hal::dma::{DmaChannel, DmaDataSize, DmaDirection, StreamX, StreamsTuple};
use stm32f4xx_hal::pac::{DMA1, Interrupt, USART2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

const BUS_CLOCK_HZ: u32 = 42_000_000;
const BAUD: u32 = 921_600;
/// Periods of the bus clock a bit.
const DIVIDER: u16 = ((BUS_CLOCK_HZ + BAUD / 2) / BAUD) as u16;

const RECEIVE_BYTES: usize = 2_048;
const TRANSMIT_BYTES: usize = 4_096;

// Atomic, because DMA writes the one and reads the other behind the compiler's back.
static RECEIVED: [AtomicU8; RECEIVE_BYTES] = [const { AtomicU8::new(0) }; RECEIVE_BYTES];
static TO_SEND: [AtomicU8; TRANSMIT_BYTES] = [const { AtomicU8::new(0) }; TRANSMIT_BYTES];

/// Bytes ever written to the ring; only the main loop moves it.
static WRITTEN: AtomicUsize = AtomicUsize::new(0);
/// Bytes ever taken from it by the DMA; only the stream's interrupt moves it.
static SENT: AtomicUsize = AtomicUsize::new(0);

/// The main loop's end of the link.
pub(crate) struct SerialLink {
    usart: USART2,
    receiving: StreamX<DMA1, 5>,
    /// Where the next byte is read from the ring.
    next_read: usize,
}

impl SerialLink {
    /// Starts both directions; the second of the pair belongs to the interrupt of DMA1 stream 6.
    pub(crate) fn start(usart: USART2, dma: DMA1, rcc: &mut Rcc) -> (Self, Transmitter) {
        let streams = StreamsTuple::new(dma, rcc);
        let (mut receiving, mut sending) = (streams.5, streams.6);
        let data_register = usart.dr().as_ptr() as u32;
        set_up(&mut receiving, DmaDirection::PeripheralToMemory, data_register);
        receiving.set_memory_address(RECEIVED.as_ptr() as u32);
        receiving.set_number_of_transfers(RECEIVE_BYTES as u16);
        receiving.set_circular_mode(true);
        // SAFETY: it writes the bytes of `RECEIVED`, which are atomic and live for ever.
        unsafe { receiving.enable() };
        set_up(&mut sending, DmaDirection::MemoryToPeripheral, data_register);
        sending.listen_transfer_complete();
        sending.listen_transfer_error();

        USART2::enable(rcc);
        USART2::reset(rcc);
        // SAFETY: mantissa and fraction together are the divider in sixteenths, with sixteen samples a bit.
        usart.brr().write(|w| unsafe { w.bits(DIVIDER) });
        usart.cr3().write(|w| {
            w.dmar().enabled();
            w.dmat().enabled()
        });
        usart.cr1().write(|w| {
            w.ue().enabled();
            w.te().enabled();
            w.re().enabled()
        });
        (Self { usart, receiving, next_read: 0 }, Transmitter { stream: sending, in_flight: 0 })
    }

    /// Bytes that were received and not read.
    fn unread(&self) -> usize {
        let next_received = RECEIVE_BYTES - usize::from(self.receiving.number_of_transfers());
        (next_received + RECEIVE_BYTES - self.next_read) % RECEIVE_BYTES
    }

    /// An overrun holds the receiver until its data register is read; the byte in it is lost, which a checksum will notice.
    fn clear_overrun(&self) {
        if self.usart.sr().read().ore().is_overrun() {
            self.usart.dr().read();
        }
    }
}

fn set_up<const S: u8>(stream: &mut StreamX<DMA1, S>, direction: DmaDirection, data_register: u32)
where
    StreamX<DMA1, S>: Stream,
{
    stream.set_channel(DmaChannel::Channel4);
    stream.set_direction(direction);
    stream.set_priority(Priority::High);
    stream.set_peripheral_address(data_register);
    stream.set_memory_increment(true);
    // SAFETY: the data register is accessed by bytes, and the rings are of bytes.
    unsafe {
        stream.set_peripheral_size(DmaDataSize::Byte);
        stream.set_memory_size(DmaDataSize::Byte);
    }
}

/// Free bytes of the transmission ring.
fn room() -> usize {
    TRANSMIT_BYTES - WRITTEN.load(Ordering::Relaxed).wrapping_sub(SENT.load(Ordering::Acquire))
}

impl ErrorType for SerialLink {
    type Error = Infallible;
}

impl ReadReady for SerialLink {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        self.clear_overrun();
        Ok(self.unread() > 0)
    }
}

impl Read for SerialLink {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while !self.read_ready()? {}
        fence(Ordering::Acquire); // what the DMA wrote is read after its count
        let taken = self.unread().min(buffer.len());
        for byte in &mut buffer[..taken] {
            *byte = RECEIVED[self.next_read].load(Ordering::Relaxed);
            self.next_read = (self.next_read + 1) % RECEIVE_BYTES;
        }
        Ok(taken)
    }
}

impl WriteReady for SerialLink {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(room() > 0)
    }
}

impl Write for SerialLink {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        if bytes.is_empty() {
            return Ok(0);
        }
        while !self.write_ready()? {}
        let written = WRITTEN.load(Ordering::Relaxed);
        let taken = room().min(bytes.len());
        for (i, byte) in bytes[..taken].iter().enumerate() {
            TO_SEND[written.wrapping_add(i) % TRANSMIT_BYTES].store(*byte, Ordering::Relaxed);
        }
        WRITTEN.store(written.wrapping_add(taken), Ordering::Release);
        rtic::pend(Interrupt::DMA1_STREAM6);
        Ok(taken)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        while room() < TRANSMIT_BYTES || self.usart.sr().read().tc().is_tx_not_complete() {}
        Ok(())
    }
}

/// The interrupt's end of the transmission.
pub(crate) struct Transmitter {
    stream: StreamX<DMA1, 6>,
    in_flight: usize,
}

impl Transmitter {
    /// Accounts for what went out and sends the next piece of the ring. Run when bytes were written and when a piece has gone.
    pub(crate) fn advance(&mut self) {
        if self.stream.is_enabled() {
            return;
        }
        self.stream.clear_all_flags();
        let sent = SENT.load(Ordering::Relaxed).wrapping_add(self.in_flight);
        SENT.store(sent, Ordering::Release);

        let start = sent % TRANSMIT_BYTES;
        let waiting = WRITTEN.load(Ordering::Acquire).wrapping_sub(sent);
        self.in_flight = waiting.min(TRANSMIT_BYTES - start);
        if self.in_flight == 0 {
            return;
        }
        // SAFETY: a write of ones and this zero clears "complete" alone, which the DMA's writes do not, and `flush` waits for.
        unsafe { &*USART2::ptr() }.sr().write(|w| w.tc().clear());
        self.stream.set_memory_address(TO_SEND[start..].as_ptr() as u32);
        self.stream.set_number_of_transfers(self.in_flight as u16);
        fence(Ordering::Release); // what was written reaches memory before the stream reads it
        // SAFETY: it reads `in_flight` bytes from `start` on, within `TO_SEND`, and the main loop keeps off them until they went.
        unsafe { self.stream.enable() };
    }
}
