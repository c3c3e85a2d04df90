"""ADC1: sequences that software starts and DMA2 takes away."""

from ..peripheral import Peripheral, Register
from ..timeline import S, US
from ..violations import Violation
from .gpio import ANALOG

STREAM = 0  # of DMA2
SCAN = 1 << 8
ADON, DMA, SWSTART = 1 << 0, 1 << 8, 1 << 30
EOC, STRT, OVR = 1 << 1, 1 << 4, 1 << 5
STABLE_AFTER = 3 * US
CLOCK_MAX_HZ = 36_000_000
SAMPLING_CYCLES = (3, 15, 28, 56, 84, 112, 144, 480)
CONVERSION_CYCLES = 12
PORT_C_FIRST_CHANNEL = 10


class Adc1(Peripheral):
    NAME = "ADC1"
    BASE = 0x4001_2000
    CLOCK = ("APB2ENR", 8)
    REGISTERS = {
        0x00: Register("SR", 0, 0x3F),
        0x04: Register("CR1", 0, 0x07C0_FFFF),
        0x08: Register("CR2", 0, 0x7F7F_0F03),
        0x0C: Register("SMPR1", 0, 0x07FF_FFFF),
        0x10: Register("SMPR2", 0, 0x3FFF_FFFF),
        0x2C: Register("SQR1", 0, 0x00FF_FFFF),
        0x30: Register("SQR2", 0, 0x3FFF_FFFF),
        0x34: Register("SQR3", 0, 0x3FFF_FFFF),
        0x4C: Register("DR", 0, 0),
        # Common to all three converters.
        0x300: Register("CSR", 0, 0),
        0x304: Register("CCR", 0, 0x00C3_EF1F),
    }
    _ends = None

    def reset(self):
        super().reset()
        self.chip.timeline.cancel(self._ends)
        self._ends = None
        self._on_since = None

    def on_stream_enabled(self, _stream):
        pass

    def write_sr(self, value):
        self.values["SR"] &= value

    def write_cr2(self, value):
        if not value & ADON:
            self.chip.timeline.cancel(self._ends)
            self._ends = self._on_since = None
        elif self._on_since is None:
            self._on_since = self.chip.timeline.now
        self.values["CR2"] = value & ~SWSTART
        if value & SWSTART:
            self._start()

    def _start(self):
        now = self.chip.timeline.now
        clock_hz = self.chip.rcc.apb2_hz // (2 * (self.values["CCR"] >> 16 & 3) + 2)
        channels = self._sequence()
        if self._ends:
            self.violation(Violation.ADC_SETUP, "started while it converts")
            return
        if self._on_since is None or now - self._on_since < STABLE_AFTER:
            self.violation(Violation.ADC_SETUP, "started before it is stable")
        if clock_hz > CLOCK_MAX_HZ:
            self.violation(Violation.ADC_SETUP, f"clock of {clock_hz} Hz")
        if not self.values["CR1"] & SCAN or not self.values["CR2"] & DMA:
            self.violation(Violation.ADC_SETUP, "a sequence without SCAN or DMA")
        for channel in set(channels):
            self.chip.gpio["C"].require(channel - PORT_C_FIRST_CHANNEL, ANALOG)
        cycles = sum(self._sampling_cycles(channel) + CONVERSION_CYCLES for channel in channels)
        self._ends = self.chip.timeline.after(cycles * S // clock_hz, lambda: self._on_end(channels))

    def _sequence(self):
        places = [("SQR3", 5 * i) for i in range(6)] + [("SQR2", 5 * i) for i in range(6)] + [("SQR1", 5 * i) for i in range(4)]
        length = (self.values["SQR1"] >> 20 & 15) + 1
        return [self.values[name] >> shift & 31 for name, shift in places[:length]]

    def _sampling_cycles(self, channel):
        name, first = ("SMPR1", 10) if channel >= 10 else ("SMPR2", 0)
        return SAMPLING_CYCLES[self.values[name] >> 3 * (channel - first) & 7]

    def _on_end(self, channels):
        self._ends = None
        dma = self.chip.dma2
        if dma.left(STREAM) != len(channels) or not dma.is_enabled(STREAM):
            self.violation(Violation.ADC_SETUP, f"{len(channels)} conversions end with {dma.left(STREAM)} expected by the DMA")
            self.values["SR"] |= OVR
            return
        for channel in channels:
            dma.put(STREAM, self.chip.outside.steps(channel).to_bytes(2, "little"))
        self.values["SR"] |= EOC | STRT
