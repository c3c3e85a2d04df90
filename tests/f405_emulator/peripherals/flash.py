"""The flash's controller, and the two sectors that a program may erase and write: the parameter slots.

Their memory is behind this model, so that every access to them is seen; the other sectors are memory that can only be read.
"""

from ..peripheral import Peripheral, Register
from ..timeline import MS, US
from ..violations import Violation

SECTOR_BYTES = 16 * 1024
SLOTS = range(0x0800_4000, 0x0800_C000)
SLOT_SECTORS = (1, 2)

KEYS = (0x4567_0123, 0xCDEF_89AB)
PG, SER, MER, STRT, LOCK = 1 << 0, 1 << 1, 1 << 2, 1 << 16, 1 << 31
OPERATION = PG | SER | MER | STRT
PRFTEN, ICEN, DCEN, ICRST, DCRST = (1 << bit for bit in range(8, 13))

# Typical, by PSIZE: 8, 16, 32, 64 bits (datasheet).
ERASE = (400 * MS, 300 * MS, 250 * MS, 250 * MS)
PROGRAM = 16 * US


class Flash(Peripheral):
    NAME = "FLASH"
    BASE = 0x4002_3C00
    WIDTHS = (1, 2, 4)
    REGISTERS = {
        0x00: Register("ACR", 0, 0x1F07),
        0x04: Register("KEYR"),
        0x0C: Register("SR", 0, 0xF3),
        0x10: Register("CR", LOCK, 0x8301_037F),
    }

    def __init__(self, chip):
        # Outlives resets and power.
        self.slots = bytearray(b"\xff" * len(SLOTS))
        self.erases = []
        super().__init__(chip)

    def reset(self):
        super().reset()
        self._keys = 0
        self._is_cache_stale = False

    def wait_states(self):
        return self.values["ACR"] & 7

    def write_acr(self, value):
        resets_running = value & DCRST and value & DCEN or value & ICRST and value & ICEN
        if resets_running:
            self.violation(Violation.CACHE_RESET_WHILE_ON, f"ACR {value:#x}")
        elif value & DCRST:
            self._is_cache_stale = False
        self.values["ACR"] = value
        self.chip.rcc.check_wait_states(self.wait_states())

    def write_keyr(self, value):
        if not self.values["CR"] & LOCK or self._keys == len(KEYS) or value != KEYS[self._keys]:
            self.violation(Violation.FLASH_KEY, f"{value:#x}")
            self._keys = len(KEYS)  # no key helps until the next reset
            self.values["CR"] |= LOCK
            return
        self._keys += 1
        if self._keys == len(KEYS):
            self._keys = 0
            self.values["CR"] &= ~LOCK

    def write_sr(self, value):
        self.values["SR"] &= ~value

    def write_cr(self, value):
        old = self.values["CR"]
        if old & LOCK:
            self.violation(Violation.FLASH_LOCKED, f"CR {value:#x}")
            return
        if value & LOCK and value & OPERATION:
            self.violation(Violation.LOCK_WITH_OPERATION, f"CR {value:#x}")
        elif value & LOCK and value != LOCK:
            self.violation(Violation.LOCK_LEAVES_BITS, f"CR {value:#x}")
        if value & PG and value & SER:
            self.violation(Violation.PG_WITH_SER, f"CR {value:#x}")
        self.values["CR"] = value & ~STRT
        if value & STRT:
            if (value ^ old) & ~(STRT | LOCK):
                self.violation(Violation.START_WITH_SETUP, f"CR {value:#x} behind {old:#x}")
            self._erase(value)

    def _erase(self, value):
        sector = value >> 3 & 15
        if not value & SER:
            self.violation(Violation.ERASE_WITHOUT_SER, f"CR {value:#x}")
        elif value & MER or sector not in SLOT_SECTORS:
            self.violation(Violation.ERASE_OUTSIDE_SLOTS, f"CR {value:#x}")
        else:
            start = (sector - SLOT_SECTORS[0]) * SECTOR_BYTES
            self.slots[start : start + SECTOR_BYTES] = b"\xff" * SECTOR_BYTES
            self.erases.append(sector)
            self._is_cache_stale = bool(self.values["ACR"] & DCEN)
            # The program comes from the same bank: the processor waits.
            self.chip.timeline.pass_by(ERASE[value >> 8 & 3])
            self.chip.core.stop()

    # ---- the slots' memory

    def read_slots(self, _uc, offset, width, _):
        if self._is_cache_stale and self.values["ACR"] & DCEN:
            self.violation(Violation.STALE_CACHE, f"{SLOTS.start + offset:#x}")
        return int.from_bytes(self.slots[offset : offset + width], "little")

    def write_slots(self, _uc, offset, width, value, _):
        address, control = SLOTS.start + offset, self.values["CR"]
        if control & LOCK:
            self.violation(Violation.FLASH_LOCKED, f"{address:#x}")
            return
        if not control & PG:
            self.violation(Violation.PROGRAM_WITHOUT_PG, f"{address:#x}")
            return
        if width != 1 << (control >> 8 & 3):
            self.violation(Violation.PROGRAM_WIDTH, f"{width} bytes at {address:#x}")
        new = value.to_bytes(width, "little")
        old = self.slots[offset : offset + width]
        programmed = bytes(a & b for a, b in zip(old, new))
        if programmed != new:
            self.violation(Violation.PROGRAM_OVER, f"{address:#x}")
        self.slots[offset : offset + width] = programmed
        self.chip.timeline.pass_by(PROGRAM)

    def write_to_program(self, address):
        self.violation(Violation.PROGRAM_OUTSIDE_SLOTS, f"{address:#x}")
