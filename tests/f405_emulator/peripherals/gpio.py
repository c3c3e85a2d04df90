"""Pins."""

from ..peripheral import Peripheral, Register
from ..violations import Violation

INPUT, OUTPUT, ALTERNATE, ANALOG = range(4)
MODES = ("an input", "an output", "an alternate function", "analogue")


class Gpio(Peripheral):
    """A port; a subclass for each, as their reset values differ."""

    WIDTHS = (1, 2, 4)

    def __init__(self, chip):
        # What drives the pins from outside; the others are pulled up.
        self.driven_low = 0
        super().__init__(chip)

    def read_idr(self):
        return 0xFFFF & ~self.driven_low

    def write_bsrr(self, value):
        self.values["ODR"] = (self.values["ODR"] & ~(value >> 16) | value) & 0xFFFF

    def mode(self, pin):
        return self.values["MODER"] >> 2 * pin & 3

    def function(self, pin):
        return self.values["AFRL" if pin < 8 else "AFRH"] >> 4 * (pin & 7) & 15

    def require(self, pin, mode, function=None):
        """What a peripheral needs of a pin."""
        if self.mode(pin) != mode or function is not None and self.function(pin) != function:
            found = f"{MODES[self.mode(pin)]} (AF{self.function(pin)})"
            self.violation(Violation.PIN_FUNCTION, f"pin {pin} is {found}, not {MODES[mode]} (AF{function})")


def registers(moder, ospeedr, pupdr):
    return {
        0x00: Register("MODER", moder),
        0x04: Register("OTYPER", 0, 0xFFFF),
        0x08: Register("OSPEEDR", ospeedr),
        0x0C: Register("PUPDR", pupdr),
        0x10: Register("IDR", 0, 0),
        0x14: Register("ODR", 0, 0xFFFF),
        0x18: Register("BSRR"),
        0x20: Register("AFRL"),
        0x24: Register("AFRH"),
    }


class GpioA(Gpio):
    NAME = "GPIOA"
    BASE = 0x4002_0000
    CLOCK = ("AHB1ENR", 0)
    REGISTERS = registers(0xA800_0000, 0, 0x6400_0000)


class GpioB(Gpio):
    NAME = "GPIOB"
    BASE = 0x4002_0400
    CLOCK = ("AHB1ENR", 1)
    REGISTERS = registers(0x280, 0xC0, 0x100)


class GpioC(Gpio):
    NAME = "GPIOC"
    BASE = 0x4002_0800
    CLOCK = ("AHB1ENR", 2)
    REGISTERS = registers(0, 0, 0)
