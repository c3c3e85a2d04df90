"""From an address to a peripheral's register."""

from .violations import Violation

PERIPHERALS = range(0x4000_0000, 0x4008_0000)
BIT_BAND = 0x4200_0000  # each word stands for a bit of what begins at 0x4000_0000
BIT_BAND_BYTES = 0x0100_0000
PRIVATE = range(0xE000_0000, 0xE010_0000)


class Bus:
    """What unicorn calls for every access that is not to memory."""

    def __init__(self, chip):
        self._violations = chip.violations
        self._by_page = {}

    def connect(self, peripheral):
        for address in range(peripheral.BASE, peripheral.BASE + peripheral.BYTES, 0x400):
            self._by_page[address >> 10] = peripheral

    def map(self, uc):
        for region in (PERIPHERALS, PRIVATE):
            start = region.start

            def read(_uc, offset, width, _, start=start):
                return self.read(start + offset, width)

            def write(_uc, offset, width, value, _, start=start):
                self.write(start + offset, width, value)

            uc.mmio_map(start, len(region), read, None, write, None)
        uc.mmio_map(BIT_BAND, BIT_BAND_BYTES, self._read_bit, None, self._write_bit, None)

    def read(self, address, width):
        peripheral = self._by_page.get(address >> 10)
        if peripheral is None:
            self._violations.add(Violation.UNKNOWN_ADDRESS, f"read of {address:#x}")
            return 0
        return peripheral.read(address - peripheral.BASE, width)

    def write(self, address, width, value):
        peripheral = self._by_page.get(address >> 10)
        if peripheral is None:
            self._violations.add(Violation.UNKNOWN_ADDRESS, f"write of {address:#x}")
            return
        peripheral.write(address - peripheral.BASE, width, value)

    @staticmethod
    def _bit(offset):
        return PERIPHERALS.start + (offset >> 5 & ~3), offset >> 2 & 31

    def _read_bit(self, _uc, offset, _width, _):
        address, bit = self._bit(offset)
        return self.read(address, 4) >> bit & 1

    def _write_bit(self, _uc, offset, _width, value, _):
        address, bit = self._bit(offset)
        old = self.read(address, 4)
        self.write(address, 4, old & ~(1 << bit) | (value & 1) << bit)
