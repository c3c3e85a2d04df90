"""The processor's own registers: system timer, interrupt controller, system control."""

from ..core import HARD_FAULT
from ..peripheral import Peripheral, Register
from ..violations import Violation

INTERRUPTS = 82
FIRST = 16  # number of the exception of interrupt 0
SYSTICK, PENDSV = 15, 14
TIMER_BITS = (1 << 24) - 1
ENABLE, TICKINT, CLKSOURCE = 1, 2, 4
KEY, SYSRESETREQ = 0x05FA, 4
NVIC_WORDS = (INTERRUPTS + 31) // 32


def _nvic():
    registers = {}
    for name, offset in (("ISER", 0x100), ("ICER", 0x180), ("ISPR", 0x200), ("ICPR", 0x280)):
        registers |= {offset + 4 * word: Register(f"{name}{word}") for word in range(NVIC_WORDS)}
    # Sixteen priorities: the lower half of each byte is not there, and takes what is written without keeping it.
    return registers | {0x400 + 4 * word: Register(f"IPR{word}") for word in range((INTERRUPTS + 3) // 4)}


class Scs(Peripheral):
    NAME = "SCS"
    BASE = 0xE000_E000
    BYTES = 0x1000
    WIDTHS = (1, 2, 4)
    REGISTERS = _nvic() | {
        0x010: Register("CTRL", 0, 0x7),
        0x014: Register("LOAD", 0, TIMER_BITS),
        0x018: Register("VAL"),
        0xD00: Register("CPUID", 0x410F_C241, 0),
        0xD04: Register("ICSR", 0, 0x9E00_0000),
        0xD08: Register("VTOR", 0, 0x3FFF_FF80),
        0xD0C: Register("AIRCR", 0xFA05_0000, 0xFFFF_0707),
        0xD10: Register("SCR", 0, 0x16),
        0xD14: Register("CCR", 0x200, 0x31B),
        0xD18: Register("SHPR1"),
        0xD1C: Register("SHPR2"),
        0xD20: Register("SHPR3"),
        0xD24: Register("SHCSR", 0, 0x7FD8B),
        0xD28: Register("CFSR"),
        0xD2C: Register("HFSR"),
        0xD88: Register("CPACR", 0, 0x00F0_0000),
        0xF00: Register("STIR", 0, 0x1FF),
        0xF34: Register("FPCCR", 0xC000_0000, 0xC000_016B),
    }
    _tick = None

    def reset(self):
        super().reset()
        self.enabled = set()
        self.pending = set()
        self._started = 0
        self._stop_timer()

    # ---- interrupts

    def request(self, interrupt):
        """A peripheral's interrupt."""
        self._pend(FIRST + interrupt)

    def _pend(self, number):
        self.pending.add(number)
        self.chip.core.stop()

    def acknowledge(self, number):
        self.pending.discard(number)

    def most_urgent(self):
        """Priority and number of the exception that waits."""
        if not self.pending:
            return None
        return min(((self.priority(n), n) for n in self.pending if n < FIRST or n in self.enabled), default=None)

    def priority(self, number):
        if number >= FIRST:
            word, at = f"IPR{(number - FIRST) // 4}", (number - FIRST) % 4
        else:
            word, at = f"SHPR{number // 4}", number % 4
        return self.values[word] >> 8 * at & 0xF0

    def read(self, offset, width):
        register = self.REGISTERS.get(offset & ~3)
        if register and register.name[:4] in ("ISER", "ICER", "ISPR", "ICPR"):
            among = self.enabled if register.name[2] == "E" else self.pending
            first = FIRST + 32 * int(register.name[4])
            return sum(1 << n - first for n in among if first <= n < first + 32)
        return super().read(offset, width)

    def write(self, offset, width, value):
        register = self.REGISTERS.get(offset & ~3)
        if register and register.name[:4] in ("ISER", "ICER", "ISPR", "ICPR"):
            first = FIRST + 32 * int(register.name[4]) + 8 * (offset & 3)
            self._change(register.name[:4], {first + bit for bit in range(8 * width) if value >> bit & 1})
            return
        super().write(offset, width, value)

    def _change(self, name, numbers):
        if any(number >= FIRST + INTERRUPTS for number in numbers):
            self.violation(Violation.RESERVED_BITS, f"{name} of interrupts that are not there")
        match name:
            case "ISER":
                self.enabled |= numbers
            case "ICER":
                self.enabled -= numbers
            case "ISPR":
                self.pending |= numbers
            case "ICPR":
                self.pending -= numbers
        self.chip.core.stop()

    def write_stir(self, value):
        self._pend(FIRST + value)

    def write_icsr(self, value):
        for bit, number in ((28, PENDSV), (26, SYSTICK)):
            if value >> bit & 1:
                self._pend(number)
            elif value >> bit - 1 & 1:
                self.pending.discard(number)

    def read_icsr(self):
        return self.chip.core.active[-1].number if self.chip.core.active else 0

    # ---- system control

    def read_aircr(self):
        return 0xFA05_0000 | self.values["AIRCR"] & 0x700

    def write_aircr(self, value):
        if value >> 16 != KEY:
            self.violation(Violation.RESERVED_BITS, f"AIRCR {value:#x} without its key")
            return
        self.values["AIRCR"] = value & 0x700
        if value & SYSRESETREQ:
            self.chip.request_reset("software")

    def read_cfsr(self):
        return self.values["CFSR"] | (0x8200 if any(a.number == HARD_FAULT for a in self.chip.core.active) else 0)

    # ---- system timer

    def _timer_cycle(self):
        return self.chip.rcc.cycle * (1 if self.values["CTRL"] & CLKSOURCE else 8)

    def read_val(self):
        if not self.values["CTRL"] & ENABLE:
            return 0
        passed = (self.chip.timeline.now - self._started) // self._timer_cycle()
        return -passed % (self.values["LOAD"] + 1)

    def write_val(self, _):
        self._start_timer()

    def write_ctrl(self, value):
        self.values["CTRL"] = value
        self._start_timer()

    def _start_timer(self):
        self._stop_timer()
        self._started = self.chip.timeline.now
        if self.values["CTRL"] & ENABLE and self.values["CTRL"] & TICKINT:
            self._tick = self.chip.timeline.after(self._timer_cycle() * (self.values["LOAD"] + 1), self._on_tick)

    def _stop_timer(self):
        self.chip.timeline.cancel(self._tick)
        self._tick = None

    def _on_tick(self):
        self._pend(SYSTICK)
        self._start_timer()
