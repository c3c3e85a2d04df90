"""External interrupts, and the system configuration that says from which port each line comes and what is seen at address 0."""

from ..peripheral import Peripheral, Register
from ..violations import Violation

LINES = 0x007F_FFFF
PORT_B = 1
# Interrupts of lines 5 to 9 and 10 to 15, which are enough here.
INTERRUPTS = {23: 0x03E0, 40: 0xFC00}


class Exti(Peripheral):
    """A line that is masked still takes note of edges: the manual leaves it open, so a program must live with it."""

    NAME = "EXTI"
    BASE = 0x4001_3C00
    REGISTERS = {
        0x00: Register("IMR", 0, LINES),
        0x08: Register("RTSR", 0, LINES),
        0x0C: Register("FTSR", 0, LINES),
        0x14: Register("PR", 0, LINES),
    }

    def reset(self):
        super().reset()
        self._asserted = set()

    def write_imr(self, value):
        self.values["IMR"] = value
        self._request()

    def write_pr(self, value):
        self.values["PR"] &= ~value
        self._request()

    def edge(self, pin, is_rising):
        """Of port B."""
        line = 1 << pin
        if self.values["RTSR" if is_rising else "FTSR"] & line:
            if self.chip.syscfg.port_of(pin) != PORT_B or self.chip.gpio["B"].mode(pin) != 0:
                self.violation(Violation.PIN_FUNCTION, f"line {pin} is not an input of port B")
            self.values["PR"] |= line
            self._request()

    def _request(self):
        """An interrupt is requested when its first line comes, and not once more with each that joins it."""
        pending = self.values["PR"] & self.values["IMR"]
        asserted = {interrupt for interrupt, lines in INTERRUPTS.items() if pending & lines}
        for interrupt in asserted - self._asserted:
            self.chip.scs.request(interrupt)
        self._asserted = asserted

    def on_return(self, interrupt):
        """A handler that leaves a line pending is entered again."""
        if interrupt in self._asserted:
            self.chip.scs.request(interrupt)


class Syscfg(Peripheral):
    NAME = "SYSCFG"
    BASE = 0x4001_3800
    CLOCK = ("APB2ENR", 14)
    REGISTERS = {
        0x00: Register("MEMRMP", 0, 0x3),
        0x08: Register("EXTICR1", 0, 0xFFFF),
        0x0C: Register("EXTICR2", 0, 0xFFFF),
        0x10: Register("EXTICR3", 0, 0xFFFF),
        0x14: Register("EXTICR4", 0, 0xFFFF),
    }

    def is_flash_at_zero(self):
        return self.values["MEMRMP"] == 0

    def port_of(self, pin):
        return self.values[f"EXTICR{pin // 4 + 1}"] >> 4 * (pin % 4) & 15
