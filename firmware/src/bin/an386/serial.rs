//! The serial link to the host: UART0.
//!
//! Receiving is by interrupt into a ring, which holds a frame of the largest size and more; what does not fit is lost, and the
//! frames' checksums notice. Transmitting is by polling: the UART takes a byte at once unless the other end holds it up.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use heapless::spsc::{Consumer, Producer, Queue};

use crate::pac::LINK_UART;

/// Bytes on their way from the receiving interrupt to the main loop.
pub(crate) type ReceivedBytes = Queue<u8, 2_048>;

/// The main loop's end of the link.
pub(crate) struct SerialLink {
    received: Consumer<'static, u8>,
}

impl SerialLink {
    /// Starts both directions; the second of the pair belongs to the receiving interrupt.
    pub(crate) fn start(ring: &'static mut ReceivedBytes) -> (Self, Receiver) {
        let (producer, received) = ring.split();
        LINK_UART.start(true);
        (Self { received }, Receiver { received: producer })
    }
}

impl ErrorType for SerialLink {
    type Error = Infallible;
}

impl ReadReady for SerialLink {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.received.ready())
    }
}

impl Read for SerialLink {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while !self.read_ready()? {}
        let mut taken = 0;
        for (place, byte) in buffer.iter_mut().zip(core::iter::from_fn(|| self.received.dequeue())) {
            *place = byte;
            taken += 1;
        }
        Ok(taken)
    }
}

impl WriteReady for SerialLink {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(LINK_UART.has_room())
    }
}

impl Write for SerialLink {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for (written, &byte) in bytes.iter().enumerate() {
            if written > 0 && !LINK_UART.has_room() {
                return Ok(written);
            }
            LINK_UART.write(byte);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        while !LINK_UART.has_room() {}
        Ok(())
    }
}

/// The interrupt's end of the link.
pub(crate) struct Receiver {
    received: Producer<'static, u8>,
}

impl Receiver {
    /// Takes the byte that has come.
    pub(crate) fn take(&mut self) {
        LINK_UART.clear_rx_interrupt();
        let _ = self.received.enqueue(LINK_UART.read());
    }
}
