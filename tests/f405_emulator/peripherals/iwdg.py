"""The independent watchdog, and the debug unit that stops it while a debugger holds the processor."""

from ..peripheral import Peripheral, Register
from ..timeline import S
from ..violations import Violation

LSI_HZ = 32_000
ACCESS, RELOAD, START = 0x5555, 0xAAAA, 0xCCCC


class Iwdg(Peripheral):
    NAME = "IWDG"
    BASE = 0x4000_3000
    WIDTHS = (2, 4)
    REGISTERS = {
        0x00: Register("KR", 0, 0xFFFF),
        0x04: Register("PR", 0, 0x7),
        0x08: Register("RLR", 0xFFF, 0xFFF),
        0x0C: Register("SR", 0, 0),
    }
    _runs_out = None

    def reset(self):
        super().reset()
        self.chip.timeline.cancel(self._runs_out)
        self._runs_out = None
        self._is_open = False
        self._is_on = False

    def read_kr(self):
        return 0

    def write_kr(self, value):
        self._is_open = value == ACCESS
        self._is_on |= value == START
        if self._is_on and value in (RELOAD, START):
            self.chip.timeline.cancel(self._runs_out)
            self._runs_out = self.chip.timeline.after(self._period(), lambda: self.chip.request_reset("watchdog"))

    def _period(self):
        return (self.values["RLR"] + 1) * (4 << min(self.values["PR"], 6)) * S // LSI_HZ

    def write_pr(self, value):
        self._set("PR", value)

    def write_rlr(self, value):
        self._set("RLR", value)

    def _set(self, name, value):
        if not self._is_open:
            self.violation(Violation.WATCHDOG_KEY, f"{name} {value:#x}")
        self.values[name] = value


class Dbgmcu(Peripheral):
    NAME = "DBGMCU"
    BASE = 0xE004_2000
    REGISTERS = {0x00: Register("IDCODE", 0x1007_6413, 0), 0x04: Register("CR", 0, 0xE7), 0x08: Register("APB1_FZ", 0, 0x06E0_1DFF)}
