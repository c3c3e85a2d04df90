"""USART2, the link to the host: its bytes come and go by DMA, at the pace of the line."""

from collections import deque

from ..peripheral import Peripheral, Register
from ..timeline import S
from ..violations import Violation
from .gpio import ALTERNATE

HOST_BAUD = 921_600
# What a receiver takes is 3.3 % and more; half of it is for the host's own.
BAUD_TOLERANCE = 0.0165
RECEIVING, SENDING = 5, 6  # streams of DMA1
BITS = 10  # of a byte on the line
# The processor is not stopped for every byte that goes out.
BYTES_AT_ONCE = 16
ORE, RXNE, TC, TXE = 1 << 3, 1 << 5, 1 << 6, 1 << 7
RE, TE, UE = 1 << 2, 1 << 3, 1 << 13
DMAR, DMAT = 1 << 6, 1 << 7
TX_PIN, RX_PIN, FUNCTION = 2, 3, 7


class Usart2(Peripheral):
    NAME = "USART2"
    BASE = 0x4000_4400
    CLOCK = ("APB1ENR", 17)
    WIDTHS = (2, 4)
    REGISTERS = {
        0x00: Register("SR", TC | TXE, 0x3FF),
        0x04: Register("DR", 0, 0x1FF),
        0x08: Register("BRR", 0, 0xFFFF),
        0x0C: Register("CR1", 0, 0xBFFF),
        0x10: Register("CR2", 0, 0x7F7F),
        0x14: Register("CR3", 0, 0xFFF),
    }
    _sends = None
    _receives = None

    def __init__(self, chip):
        self._coming = deque()
        self.lost = 0
        super().__init__(chip)

    def reset(self):
        super().reset()
        self.chip.timeline.cancel(self._sends)
        self._sends = None

    def read_dr(self):
        self.values["SR"] &= ~(ORE | RXNE)
        return self.values["DR"]

    def write_sr(self, value):
        # Written with zero to clear, and these four only.
        self.values["SR"] &= value | ~(TC | RXNE | 0x300)

    def write_cr1(self, value):
        self.values["CR1"] = value
        self._send()

    def write_cr3(self, value):
        self.values["CR3"] = value
        self._send()

    def on_stream_enabled(self, stream):
        if stream == SENDING:
            self._send()

    def _byte(self):
        return max(1, self.values["BRR"]) * BITS * S // self.chip.rcc.apb1_hz

    def _check(self, pin):
        divider = self.values["BRR"]
        baud = self.chip.rcc.apb1_hz / divider if divider else 0
        if abs(baud / HOST_BAUD - 1) > BAUD_TOLERANCE:
            self.violation(Violation.USART_SETUP, f"{baud:.0f} baud")
        self.chip.gpio["A"].require(pin, ALTERNATE, FUNCTION)

    # ---- to the host

    def _send(self):
        dma = self.chip.dma1
        if self._sends or not dma.is_enabled(SENDING):
            return
        if self.values["CR1"] & (UE | TE) != UE | TE or not self.values["CR3"] & DMAT:
            self.violation(Violation.USART_SETUP, "stream enabled before the transmitter")
            return
        self._check(TX_PIN)
        count = min(BYTES_AT_ONCE, dma.left(SENDING))
        self._sends = self.chip.timeline.after(count * self._byte(), lambda: self._on_sent(count))

    def _on_sent(self, count):
        self._sends = None
        self.chip.outside.on_link_bytes(self.chip.dma1.take(SENDING, count))
        if self.chip.dma1.is_enabled(SENDING):
            self._send()
        else:
            self.values["SR"] |= TC

    # ---- from the host

    def receive(self, data):
        self._coming.extend(data)
        self._expect()

    def _expect(self):
        if self._coming and not self._receives:
            self._receives = self.chip.timeline.after(BITS * S // HOST_BAUD, self._on_byte)

    def _on_byte(self):
        self._receives = None
        byte = self._coming.popleft()
        self._expect()
        if not self.is_clocked() or self.values["CR1"] & (UE | RE) != UE | RE:
            self.lost += 1
            return
        self._check(RX_PIN)
        if self.values["CR3"] & DMAR and self.chip.dma1.is_enabled(RECEIVING):
            self.chip.dma1.put(RECEIVING, bytes([byte]))
        else:
            self.values["SR"] |= ORE if self.values["SR"] & RXNE else RXNE
            self.values["DR"] = byte
