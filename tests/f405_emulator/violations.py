"""What a program must not do to this chip, by name."""

from collections import Counter
from enum import Enum


class Violation(Enum):
    """The name that a report uses, and what is wrong with it."""

    UNKNOWN_ADDRESS = "no register that the models know"
    UNCLOCKED = "a register of a peripheral whose clock is off"
    WIDTH = "an access of a width that the peripheral does not take"
    RESERVED_BITS = "a one written to a bit that is reserved or read-only"
    OUTSIDE_MEMORY = "an access to an address where nothing is"
    UNDEFINED_INSTRUCTION = "an instruction that this processor does not have"
    FOREIGN_VECTOR = "an exception through a vector table that is not the program's"
    LOCKUP = "a fault inside of a fault"

    CLOCK_NOT_READY = "a clock taken before it is ready"
    CLOCK_LIMIT = "a clock beyond what the chip allows"
    PLL_CHANGED_WHILE_ON = "the PLL's factors written while it runs"
    WAIT_STATES = "fewer wait states of the flash than its clock needs"

    FLASH_KEY = "a key out of order, or to a controller that is open"
    FLASH_LOCKED = "the controller's register written, or flash programmed, while it is locked"
    LOCK_WITH_OPERATION = "LOCK in one value with PG, SER, MER or STRT"
    LOCK_LEAVES_BITS = "LOCK in one value with other bits than the register had after reset"
    START_WITH_SETUP = "STRT in one write with a change of what it starts"
    ERASE_WITHOUT_SER = "STRT without SER"
    ERASE_OUTSIDE_SLOTS = "an erase of a sector that holds program"
    PG_WITH_SER = "PG and SER at once"
    PROGRAM_WITHOUT_PG = "flash written to without PG"
    PROGRAM_WIDTH = "flash written in another width than PSIZE says"
    PROGRAM_OVER = "flash programmed that is not erased"
    PROGRAM_OUTSIDE_SLOTS = "a write to flash that holds program"
    CACHE_RESET_WHILE_ON = "a cache of the flash reset while it is on"
    STALE_CACHE = "an erased sector read through a data cache that was not reset since"

    WATCHDOG_KEY = "the watchdog's period written without its key"
    DMA_WIRING = "a stream enabled with a channel, direction, width or memory that its peripheral does not have"
    DMA_CHANGED_WHILE_ON = "a stream's register written while the stream is enabled"
    DMA_FLAGS_LEFT = "a stream enabled with flags of its last transfer"
    USART_SETUP = "a transfer over a USART that is off, or at a baud rate that is not the host's"
    ADC_SETUP = "a conversion that is started or ends where it cannot"
    TIMER_SETUP = "a timer started that does not count as it should"
    PIN_FUNCTION = "a peripheral used through a pin that is not its"


class Violations:
    """All that happened: of each kind how often, and where first."""

    def __init__(self):
        self.where = lambda: ""
        self._counts = Counter()
        self._first = {}

    def add(self, violation, detail):
        self._counts[violation] += 1
        if violation not in self._first:
            self._first[violation] = f"{detail}{self.where()}"

    def names(self):
        return {violation.name for violation in self._counts}

    def lines(self):
        return [f"{kind.name}: {kind.value}; {count} times, first {self._first[kind]}" for kind, count in self._counts.items()]
