"""The two DMA controllers, as far as transfers between memory and one peripheral's data register go."""

from dataclasses import dataclass
from functools import partial

from ..peripheral import Peripheral, Register
from ..violations import Violation

SRAM = range(0x2000_0000, 0x2002_0000)
STREAMS = 8
STREAM_BYTES = 0x18
EN, TCIE, CIRC, MINC = 1 << 0, 1 << 4, 1 << 8, 1 << 10
COMPLETE = 1 << 5  # among the six flags of a stream
FLAGS = 0x3D
FLAG_SHIFTS = (0, 6, 16, 22)
TO_MEMORY, FROM_MEMORY = 0, 1


@dataclass(frozen=True)
class Wire:
    """What a stream must be set to for the peripheral at its other end (RM0090, tables 42 and 43)."""

    peripheral: str  # attribute of the chip
    channel: int
    direction: int
    data_register: int
    bytes: int
    interrupt: int


def _registers():
    registers = {
        0x00: Register("LISR", 0, 0),
        0x04: Register("HISR", 0, 0),
        0x08: Register("LIFCR", 0, 0x0F7D_0F7D),
        0x0C: Register("HIFCR", 0, 0x0F7D_0F7D),
    }
    for s in range(STREAMS):
        start = 0x10 + STREAM_BYTES * s
        registers |= {
            start: Register(f"S{s}CR", 0, 0x0FEF_FFFF),
            start + 0x04: Register(f"S{s}NDTR", 0, 0xFFFF),
            start + 0x08: Register(f"S{s}PAR"),
            start + 0x0C: Register(f"S{s}M0AR"),
            start + 0x10: Register(f"S{s}M1AR"),
            start + 0x14: Register(f"S{s}FCR", 0x21, 0x87),
        }
    return registers


class Dma(Peripheral):
    """A controller; `WIRES` are the streams that this board uses."""

    REGISTERS = _registers()
    WIRES = {}

    def __init__(self, chip):
        super().__init__(chip)
        for offset, register in self.REGISTERS.items():
            if offset >= 0x10:
                self._writers[offset] = partial(self._write_stream, (offset - 0x10) // STREAM_BYTES, register.name)

    def reset(self):
        super().reset()
        self._reload = dict.fromkeys(range(STREAMS), 0)

    def write_lifcr(self, value):
        self.values["LISR"] &= ~value

    def write_hifcr(self, value):
        self.values["HISR"] &= ~value

    def _write_stream(self, stream, name, value):
        old = self.values[f"S{stream}CR"]
        is_control = name.endswith("CR") and not name.endswith("FCR")
        if old & EN and not (is_control and (value ^ old) in (0, EN)):
            self.violation(Violation.DMA_CHANGED_WHILE_ON, f"{name} {value:#x}")
        self.values[name] = value
        if is_control and value & EN and not old & EN:
            self._enable(stream)

    def _enable(self, stream):
        self._reload[stream] = self.values[f"S{stream}NDTR"]
        flags, shift = self._flags(stream)
        if self.values[flags] >> shift & FLAGS:
            self.violation(Violation.DMA_FLAGS_LEFT, f"stream {stream}")
        self._check(stream)
        if wire := self.WIRES.get(stream):
            getattr(self.chip, wire.peripheral).on_stream_enabled(stream)

    def _check(self, stream):
        control = self.values[f"S{stream}CR"]
        memory, count = self.values[f"S{stream}M0AR"], self.values[f"S{stream}NDTR"]
        wire = self.WIRES.get(stream)
        found = (control >> 25 & 7, control >> 6 & 3, self.values[f"S{stream}PAR"], 1 << (control >> 11 & 3), 1 << (control >> 13 & 3))
        expected = wire and (wire.channel, wire.direction, wire.data_register, wire.bytes, wire.bytes)
        last = memory + count * found[4] - 1
        if found != expected or not control & MINC or memory not in SRAM or last not in SRAM or not count:
            self.violation(Violation.DMA_WIRING, f"stream {stream}: {found}, {count} from {memory:#x}, expected {expected}")

    @staticmethod
    def _flags(stream):
        return "HISR" if stream >= 4 else "LISR", FLAG_SHIFTS[stream % 4]

    # ---- for the peripherals at the other ends

    def is_enabled(self, stream):
        return bool(self.values[f"S{stream}CR"] & EN)

    def left(self, stream):
        return self.values[f"S{stream}NDTR"]

    def take(self, stream, count):
        """So many units out of memory."""
        size = self.WIRES[stream].bytes
        data = bytes(self.chip.core.uc.mem_read(self._address(stream, size), count * size))
        self._advance(stream, count)
        return data

    def put(self, stream, data):
        """One unit into memory."""
        self.chip.core.uc.mem_write(self._address(stream, len(data)), data)
        self._advance(stream, 1)

    def _address(self, stream, size):
        return self.values[f"S{stream}M0AR"] + (self._reload[stream] - self.left(stream)) * size

    def _advance(self, stream, count):
        left = self.left(stream) - count
        control = self.values[f"S{stream}CR"]
        if left == 0:
            flags, shift = self._flags(stream)
            self.values[flags] |= COMPLETE << shift
            if control & CIRC:
                left = self._reload[stream]
            else:
                self.values[f"S{stream}CR"] &= ~EN
            if control & TCIE:
                self.chip.scs.request(self.WIRES[stream].interrupt)
        self.values[f"S{stream}NDTR"] = left


class Dma1(Dma):
    NAME = "DMA1"
    BASE = 0x4002_6000
    CLOCK = ("AHB1ENR", 21)
    WIRES = {
        5: Wire("usart2", channel=4, direction=TO_MEMORY, data_register=0x4000_4404, bytes=1, interrupt=16),
        6: Wire("usart2", channel=4, direction=FROM_MEMORY, data_register=0x4000_4404, bytes=1, interrupt=17),
    }


class Dma2(Dma):
    NAME = "DMA2"
    BASE = 0x4002_6400
    CLOCK = ("AHB1ENR", 22)
    WIRES = {0: Wire("adc1", channel=0, direction=TO_MEMORY, data_register=0x4001_204C, bytes=2, interrupt=56)}
