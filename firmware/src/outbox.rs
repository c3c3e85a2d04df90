//! Frames on their way to the link.

use ballbar::wire::MAX_FRAME;
use heapless::Deque;

use crate::Link;

/// Bytes that wait: three frames of the largest size, 40 ms of a link at 921,600 baud.
const CAPACITY: usize = 3 * MAX_FRAME + 512;

/// Holds whole frames until the link takes their bytes. What does not fit is refused, so that nothing ever waits for the link.
pub(crate) struct Outbox {
    bytes: Deque<u8, CAPACITY>,
}

impl Outbox {
    pub(crate) fn new() -> Self {
        // A zero first: whatever the other end heard while this one started is no frame.
        let mut bytes = Deque::new();
        let _ = bytes.push_back(0);
        Self { bytes }
    }

    /// Queues a frame of the stream, unless it would take the room that a reply may need.
    pub(crate) fn push_stream(&mut self, frame: &[u8]) -> bool {
        self.push(frame, MAX_FRAME)
    }

    /// Queues a reply.
    pub(crate) fn push_reply(&mut self, frame: &[u8]) -> bool {
        self.push(frame, 0)
    }

    fn push(&mut self, frame: &[u8], reserve: usize) -> bool {
        if self.bytes.len() + frame.len() + reserve > CAPACITY {
            return false;
        }
        self.bytes.extend(frame.iter().copied());
        true
    }

    /// Gives the link as many bytes as it takes now.
    pub(crate) fn drain(&mut self, link: &mut impl Link) {
        while !self.bytes.is_empty() && matches!(link.write_ready(), Ok(true)) {
            let Ok(written @ 1..) = link.write(self.bytes.as_slices().0) else { return };
            for _ in 0..written {
                self.bytes.pop_front();
            }
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }
}
