"""What all peripherals have in common."""

from dataclasses import dataclass

from .violations import Violation

WORD = 0xFFFF_FFFF


@dataclass(frozen=True)
class Register:
    """A register of 32 bits; `writable` are the bits that software may set to one."""

    name: str
    reset: int = 0
    writable: int = WORD


class Peripheral:
    """Registers behind one base address.

    A subclass lists them in REGISTERS by offset and gives those that do more than keep their value a method: `read_sr(self)` returns
    what is read of SR, `write_cr(self, value)` does what a write to CR does, `self.values["CR"] = value` included.
    """

    NAME = ""
    BASE = 0
    BYTES = 0x400
    # Enable register of the RCC, and the bit in it; None where the clock is always on.
    CLOCK = None
    # Bytes at once.
    WIDTHS = (4,)
    REGISTERS = {}

    def __init__(self, chip):
        self.chip = chip
        self._readers = {offset: getattr(self, f"read_{r.name.lower()}", None) for offset, r in self.REGISTERS.items()}
        self._writers = {offset: getattr(self, f"write_{r.name.lower()}", None) for offset, r in self.REGISTERS.items()}
        self.values = {}
        self.reset()

    def reset(self):
        """To the values after a reset; a subclass also forgets what it was about to do."""
        self.values = {register.name: register.reset for register in self.REGISTERS.values()}

    def violation(self, violation, detail):
        self.chip.violations.add(violation, f"{self.NAME}: {detail}")

    def is_clocked(self):
        return self.CLOCK is None or bool(self.chip.rcc.values[self.CLOCK[0]] >> self.CLOCK[1] & 1)

    def read(self, offset, width):
        register = self._checked("read", offset, width)
        if register is None:
            return 0
        word = self._word(offset & ~3, register)
        return word >> 8 * (offset & 3) & (1 << 8 * width) - 1

    def write(self, offset, width, value):
        register = self._checked("write", offset, width)
        if register is None:
            return
        start = offset & ~3
        if width < 4:
            shift = 8 * (offset & 3)
            mask = (1 << 8 * width) - 1 << shift
            value = self.values[register.name] & ~mask | value << shift & mask
        wrong = value & ~register.writable
        if wrong & ~self._word(start, register):
            self.violation(Violation.RESERVED_BITS, f"{value:#x} to {register.name}")
        value &= register.writable
        if writer := self._writers[start]:
            writer(value)
        else:
            self.values[register.name] = value

    def _word(self, start, register):
        reader = self._readers[start]
        return reader() if reader else self.values[register.name]

    def _checked(self, what, offset, width):
        register = self.REGISTERS.get(offset & ~3)
        if register is None:
            self.violation(Violation.UNKNOWN_ADDRESS, f"{what} of offset {offset:#x}")
        elif not self.is_clocked():
            self.violation(Violation.UNCLOCKED, f"{what} of {register.name}")
        elif width not in self.WIDTHS or offset % width:
            self.violation(Violation.WIDTH, f"{what} of {width} bytes of {register.name}")
        else:
            return register
        return None
