"""Timers: six that count encoders, and TIM7, which interrupts."""

from ..peripheral import WORD, Peripheral, Register
from ..timeline import S
from ..violations import Violation
from .gpio import ALTERNATE

CEN, ARPE, UIF, UIE, UG = 1 << 0, 1 << 7, 1, 1, 1
ENCODER_MODE_3 = 3
BOTH_FROM_THEIR_PINS = 0x0101  # CC1S and CC2S of CCMR1
TIM7_INTERRUPT = 55


class EncoderTimer(Peripheral):
    """Counts what joint `JOINT` of the plant does, when it is set to."""

    WIDTHS = (2, 4)
    JOINT = 0
    BITS = 16
    # Port, pin, pin and their function.
    PINS = ("A", 0, 0, 0)
    REGISTERS = {
        0x00: Register("CR1", 0, 0x3FF),
        0x04: Register("CR2", 0, 0x7FFD),
        0x08: Register("SMCR", 0, 0xFFF7),
        0x0C: Register("DIER", 0, 0x7FFF),
        0x10: Register("SR", 0, 0x1EFF),
        0x14: Register("EGR", 0, 0xFF),
        0x18: Register("CCMR1", 0, 0xFFFF),
        0x20: Register("CCER", 0, 0xFFFF),
        0x24: Register("CNT"),
        0x28: Register("PSC", 0, 0xFFFF),
        0x2C: Register("ARR", WORD),
    }

    def reset(self):
        super().reset()
        self.values["ARR"] = self._top()

    def _top(self):
        return (1 << self.BITS) - 1

    def write_cr1(self, value):
        self.values["CR1"] = value
        if value & CEN:
            self._check()

    def _check(self):
        v = self.values
        if v["SMCR"] & 7 != ENCODER_MODE_3 or v["CCMR1"] & 0x0303 != BOTH_FROM_THEIR_PINS or v["ARR"] != self._top() or v["PSC"]:
            self.violation(Violation.TIMER_SETUP, f"SMCR {v['SMCR']:#x}, CCMR1 {v['CCMR1']:#x}, ARR {v['ARR']:#x}")
        for port, pin, function in self.PINS:
            self.chip.gpio[port].require(pin, ALTERNATE, function)

    def read_cnt(self):
        if not self.values["CR1"] & CEN:
            return self.values["CNT"]
        return self.chip.outside.counts(self.JOINT) & self._top()


def _encoder(name, base, clock, joint, bits, pins):
    facts = {"NAME": name, "BASE": base, "CLOCK": clock, "JOINT": joint, "BITS": bits, "PINS": pins}
    return type(name, (EncoderTimer,), facts)


ENCODER_TIMERS = (
    _encoder("TIM1", 0x4001_0000, ("APB2ENR", 0), 0, 16, (("A", 8, 1), ("A", 9, 1))),
    _encoder("TIM3", 0x4000_0400, ("APB1ENR", 1), 1, 16, (("A", 6, 2), ("A", 7, 2))),
    _encoder("TIM4", 0x4000_0800, ("APB1ENR", 2), 2, 16, (("B", 6, 2), ("B", 7, 2))),
    _encoder("TIM2", 0x4000_0000, ("APB1ENR", 0), 3, 32, (("A", 15, 1), ("B", 3, 1))),
    _encoder("TIM8", 0x4001_0400, ("APB2ENR", 1), 4, 16, (("C", 6, 3), ("C", 7, 3))),
    _encoder("TIM5", 0x4000_0C00, ("APB1ENR", 3), 5, 32, (("A", 0, 2), ("A", 1, 2))),
)


class Tim7(Peripheral):
    NAME = "TIM7"
    BASE = 0x4000_1400
    CLOCK = ("APB1ENR", 5)
    WIDTHS = (2, 4)
    REGISTERS = {
        0x00: Register("CR1", 0, 0x8F),
        0x04: Register("CR2", 0, 0x70),
        0x0C: Register("DIER", 0, 0x101),
        0x10: Register("SR", 0, 1),
        0x14: Register("EGR", 0, 1),
        0x24: Register("CNT", 0, 0xFFFF),
        0x28: Register("PSC", 0, 0xFFFF),
        0x2C: Register("ARR", 0xFFFF, 0xFFFF),
    }
    _updates = None

    def __init__(self, chip):
        # Periods that ended, and those of them that found the one before unserved.
        self.updates = self.missed = 0
        super().__init__(chip)

    def reset(self):
        super().reset()
        self.chip.timeline.cancel(self._updates)
        self._updates = None
        self._take_over()

    def _take_over(self):
        self._ticks = (self.values["PSC"] + 1) * (self.values["ARR"] + 1)

    def _period(self):
        return self._ticks * S // self.chip.rcc.apb1_timer_hz

    def write_egr(self, value):
        if value & UG:
            self._take_over()
            self.values["SR"] |= UIF

    def write_sr(self, value):
        self.values["SR"] &= value

    def write_arr(self, value):
        self.values["ARR"] = value
        if not self.values["CR1"] & ARPE:
            self._take_over()

    def write_cr1(self, value):
        self.values["CR1"] = value
        self.chip.timeline.cancel(self._updates)
        self._updates = None
        if value & CEN:
            self._expect_update(self.chip.timeline.now)

    def _expect_update(self, since):
        due = since + self._period()
        self._updates = self.chip.timeline.at(due, lambda: self._on_update(due))

    def _on_update(self, due):
        self._take_over()
        self._expect_update(due)
        self.updates += 1
        self.missed += self.values["SR"] & UIF
        self.values["SR"] |= UIF
        if self.values["DIER"] & UIE:
            self.chip.scs.request(TIM7_INTERRUPT)
