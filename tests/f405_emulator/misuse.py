"""A wrong program for every violation: each must be reported by its name, and nothing beside it.

    python -m f405_emulator.misuse

The programs are one instruction long, a load or a store, run by the emulated processor from its memory as often as a case needs.
"""

import struct
import sys

from unicorn import arm_const as arm

from .chip import SRAM, Chip, Start
from .peripherals.flash import DCEN, DCRST, KEYS, LOCK, PG, SER, SLOTS, STRT
from .timeline import MS, US
from .violations import Violation

RCC, FLASH, IWDG, DMA1, USART2, ADC1 = 0x4002_3800, 0x4002_3C00, 0x4000_3000, 0x4002_6000, 0x4000_4400, 0x4001_2000
GPIOA, GPIOC, TIM3, SCS, EXTI, SYSCFG = 0x4002_0000, 0x4002_0800, 0x4000_0400, 0xE000_E000, 0x4001_3C00, 0x4001_3800
ACR, KEYR, CR = FLASH, FLASH + 4, FLASH + 0x10
PSIZE_32 = 2 << 8
SECTOR_1 = 1 << 3

WFI, TO_ITSELF = 0xBF30, 0xE7FE
STORE = {4: 0x6001, 2: 0x8001, 1: 0x7001}  # str, strh, strb r1, [r0]
LOAD = 0x6801  # ldr r1, [r0]
UNDEFINED = 0xDE00
PROGRAM = SRAM.start + 0x4000
HANDLER = SRAM.start + 0x5000
STACK = SRAM.start + 0x8000
VECTORS = 98


class NoProgram:
    """A vector table, and nothing else; all exceptions are handled by what stands at HANDLER."""

    segments = ((0x0800_0000, struct.pack(f"<{VECTORS}I", STACK, *[HANDLER | 1] * (VECTORS - 1))),)

    @staticmethod
    def name(address):
        return f"{address:#010x}"


class Bench:
    """A chip whose processor does one access after the other."""

    def __init__(self, start=Start.POWER_ON):
        self.chip = Chip(NoProgram, start)
        self.handle_by(WFI)

    def handle_by(self, instruction):
        self.chip.core.uc.mem_write(HANDLER, struct.pack("<2H", instruction, TO_ITSELF))

    def execute(self, instruction, r0=0, r1=0):
        uc = self.chip.core.uc
        uc.mem_write(PROGRAM, struct.pack("<2H", instruction, WFI))
        # What was translated of the program before is not what stands there now.
        uc.ctl_remove_cache(PROGRAM, PROGRAM + 4)
        for register, value in ((arm.UC_ARM_REG_R0, r0), (arm.UC_ARM_REG_R1, r1)):
            uc.reg_write(register, value)
        self.chip.core.pc, self.chip.core.sleeps = PROGRAM, False
        self.chip.run(US)

    def store(self, address, value, width=4):
        self.execute(STORE[width], address, value)

    def load(self, address):
        self.execute(LOAD, address)

    def clock(self, register, bit):
        self.store(RCC + register, self.chip.rcc.values[{0x30: "AHB1ENR", 0x40: "APB1ENR", 0x44: "APB2ENR"}[register]] | 1 << bit)

    def unlock(self):
        for key in KEYS:
            self.store(KEYR, key)

    def full_speed(self, wait_states=5, buses=5 << 10 | 4 << 13):
        """168 MHz from the crystal, 42 and 84 MHz for the buses."""
        self.store(RCC, 0x1_0083)
        self.chip.run(5 * MS)
        self.store(RCC + 4, 0x0740_5408)
        self.store(RCC, 0x0101_0083)
        self.chip.run(MS)
        self.store(ACR, wait_states)
        self.store(RCC + 8, 2 | buses)

    def stream(self, control):
        """DMA1's stream 6, USART2's transmission, all but its control right."""
        self.clock(0x30, 21)
        self.store(DMA1 + 0xA8, USART2 + 4)
        self.store(DMA1 + 0xAC, SRAM.start)
        self.store(DMA1 + 0xA4, 4)
        self.store(DMA1 + 0xA0, control)

    def usart(self, divider, pin_modes):
        self.full_speed()
        self.clock(0x30, 0)
        self.clock(0x40, 17)
        self.store(GPIOA + 0x20, 0x700)
        self.store(GPIOA, pin_modes)
        self.store(USART2 + 8, divider)
        self.store(USART2 + 0x14, 1 << 7)
        self.store(USART2 + 0xC, 1 << 13 | 1 << 3)


# Channel 4, memory increment, from memory, enabled.
GOOD_STREAM = 4 << 25 | 1 << 10 | 1 << 6 | 1
# PA2 as an alternate function, with the reset value of the others.
TX_PIN = 0xA800_0020
GOOD_DIVIDER = 46  # of 42 MHz: 913,043 baud
CASES = []


def case(violation, start=Start.POWER_ON, also=frozenset()):
    def register(function):
        CASES.append((violation, start, {violation.name, *also}, function))
        return function

    return register


def stores(violation, *pairs):
    """A case of stores, address and value in turn."""

    @case(violation)
    def _(bench):
        for address, value in pairs:
            bench.store(address, value)


def unlocked_stores(violation, *pairs):
    """The same with the flash unlocked before."""

    @case(violation)
    def _(bench):
        bench.unlock()
        for address, value in pairs:
            bench.store(address, value)


stores(Violation.UNKNOWN_ADDRESS, (RCC + 0x3C, 0))
stores(Violation.UNKNOWN_ADDRESS, (0x4001_4800, 0))  # TIM11
stores(Violation.UNCLOCKED, (GPIOC, 1))
stores(Violation.UNCLOCKED, (SYSCFG + 8, 1))
stores(Violation.RESERVED_BITS, (EXTI, 1 << 23))
stores(Violation.OUTSIDE_MEMORY, (0x2002_0000, 0))
stores(Violation.OUTSIDE_MEMORY, (0x6000_0000, 0))
stores(Violation.CLOCK_NOT_READY, (RCC + 8, 1))
stores(Violation.CLOCK_NOT_READY, (RCC + 4, 0x0740_5408), (RCC, 0x0100_0083))
stores(Violation.CLOCK_LIMIT, (RCC + 4, 0x0400_5401), (RCC, 0x0100_0083))
stores(Violation.PLL_CHANGED_WHILE_ON, (RCC + 4, 0x0400_5410), (RCC, 0x0100_0083), (RCC + 4, 0x0400_5411))
stores(Violation.FLASH_KEY, (KEYR, KEYS[1]))
stores(Violation.FLASH_KEY, (KEYR, KEYS[0]), (KEYR, KEYS[1]), (KEYR, KEYS[0]))
stores(Violation.FLASH_LOCKED, (CR, PSIZE_32))
stores(Violation.FLASH_LOCKED, (SLOTS.start, 0))
unlocked_stores(Violation.LOCK_WITH_OPERATION, (CR, LOCK | PSIZE_32 | PG))
unlocked_stores(Violation.LOCK_WITH_OPERATION, (CR, PSIZE_32 | SER | SECTOR_1), (CR, LOCK | PSIZE_32 | SER | SECTOR_1 | STRT))
unlocked_stores(Violation.LOCK_LEAVES_BITS, (CR, LOCK | PSIZE_32))
unlocked_stores(Violation.START_WITH_SETUP, (CR, PSIZE_32 | SER | SECTOR_1 | STRT))
unlocked_stores(Violation.ERASE_WITHOUT_SER, (CR, PSIZE_32), (CR, PSIZE_32 | STRT))
unlocked_stores(Violation.ERASE_OUTSIDE_SLOTS, (CR, SER | 3 << 3), (CR, SER | 3 << 3 | STRT))
unlocked_stores(Violation.ERASE_OUTSIDE_SLOTS, (CR, SER | SECTOR_1 | 1 << 2), (CR, SER | SECTOR_1 | 1 << 2 | STRT))
unlocked_stores(Violation.PG_WITH_SER, (CR, PG | SER))
unlocked_stores(Violation.PROGRAM_WITHOUT_PG, (CR, PSIZE_32), (SLOTS.start, 0))
unlocked_stores(Violation.PROGRAM_WIDTH, (CR, PG), (SLOTS.start, 0))
unlocked_stores(Violation.PROGRAM_OVER, (CR, PSIZE_32 | PG), (SLOTS.start, 1), (SLOTS.start, 2))
unlocked_stores(Violation.PROGRAM_OUTSIDE_SLOTS, (CR, PSIZE_32 | PG), (SLOTS.stop, 0))
stores(Violation.CACHE_RESET_WHILE_ON, (ACR, DCEN), (ACR, DCEN | DCRST))
stores(Violation.WATCHDOG_KEY, (IWDG + 8, 100))
stores(Violation.WATCHDOG_KEY, (IWDG, 0x5555), (IWDG, 0xAAAA), (IWDG + 4, 6))


@case(Violation.WIDTH)
def _(bench):
    bench.clock(0x44, 8)
    bench.store(ADC1 + 0x2C, 0, width=2)


@case(Violation.OUTSIDE_MEMORY)
def _(bench):
    bench.load(SRAM.start - 4)


@case(Violation.UNDEFINED_INSTRUCTION)
def _(bench):
    bench.execute(UNDEFINED)


@case(Violation.FOREIGN_VECTOR, Start.AFTER_DFU)
def _(bench):
    bench.store(SCS + 0xD04, 1 << 28)


@case(Violation.FOREIGN_VECTOR)
def _(bench):
    bench.store(SCS + 0xD08, SRAM.start)
    bench.store(SCS + 0xD04, 1 << 28)


@case(Violation.WAIT_STATES)
def _(bench):
    bench.full_speed(wait_states=4)


@case(Violation.CLOCK_LIMIT)
def _(bench):
    bench.full_speed(buses=5 << 10)  # the second at 168 MHz


@case(Violation.STALE_CACHE)
def _(bench):
    bench.store(ACR, DCEN)
    bench.unlock()
    bench.store(CR, PSIZE_32 | SER | SECTOR_1)
    bench.store(CR, PSIZE_32 | SER | SECTOR_1 | STRT)
    bench.load(SLOTS.start)


@case(Violation.DMA_WIRING)  # a channel that is not the USART's
def _(bench):
    bench.usart(GOOD_DIVIDER, TX_PIN)
    bench.stream(GOOD_STREAM ^ 1 << 25)


@case(Violation.DMA_WIRING)  # half-words
def _(bench):
    bench.usart(GOOD_DIVIDER, TX_PIN)
    bench.stream(GOOD_STREAM | 1 << 11)


@case(Violation.DMA_WIRING)  # memory that the DMA does not reach
def _(bench):
    bench.usart(GOOD_DIVIDER, TX_PIN)
    bench.stream(0)
    bench.store(DMA1 + 0xAC, SRAM.stop - 2)
    # Not to its end, where the model would read what is not there.
    bench.store(DMA1 + 0xA0, GOOD_STREAM)
    bench.store(DMA1 + 0xA0, GOOD_STREAM & ~1)


@case(Violation.DMA_CHANGED_WHILE_ON)
def _(bench):
    bench.usart(GOOD_DIVIDER, TX_PIN)
    bench.stream(GOOD_STREAM)
    bench.store(DMA1 + 0xA4, 8)


@case(Violation.DMA_FLAGS_LEFT)
def _(bench):
    bench.usart(GOOD_DIVIDER, TX_PIN)
    bench.stream(GOOD_STREAM)
    bench.chip.run(MS)
    bench.store(DMA1 + 0xA4, 4)
    bench.store(DMA1 + 0xA0, GOOD_STREAM)


@case(Violation.USART_SETUP)
def _(bench):
    bench.usart(44, TX_PIN)
    bench.stream(GOOD_STREAM)


@case(Violation.USART_SETUP)
def _(bench):
    bench.stream(GOOD_STREAM)


@case(Violation.PIN_FUNCTION)
def _(bench):
    bench.usart(GOOD_DIVIDER, 0xA800_0000)
    bench.stream(GOOD_STREAM)


@case(Violation.PIN_FUNCTION)
def _(bench):
    bench.store(EXTI + 8, 1 << 8)
    bench.chip.outside.ring(0, pulses_per_s=1000, high_ns=1000)


@case(Violation.ADC_SETUP)
def _(bench):
    bench.clock(0x30, 2)
    bench.store(GPIOC, 3)
    bench.clock(0x44, 8)
    bench.store(ADC1 + 0x34, 10)
    bench.store(ADC1 + 4, 1 << 8)
    bench.store(ADC1 + 8, 1 << 8 | 1)
    bench.store(ADC1 + 8, 1 << 30 | 1 << 8 | 1)


@case(Violation.TIMER_SETUP)
def _(bench):
    bench.clock(0x30, 0)
    bench.store(GPIOA + 0x20, 0x2200_0000)
    bench.store(GPIOA, 0xA800_A000)
    bench.clock(0x40, 1)
    bench.store(TIM3 + 8, 2)
    bench.store(TIM3 + 0x18, 0x0101)
    bench.store(TIM3, 1)


@case(Violation.LOCKUP, also={"UNDEFINED_INSTRUCTION"})
def _(bench):
    bench.handle_by(UNDEFINED)
    bench.execute(UNDEFINED)


def main():
    missing = set(Violation) - {violation for violation, *_ in CASES}
    failed = [f"{violation.name}: no case" for violation in missing]
    for violation, start, expected, program in CASES:
        bench = Bench(start)
        program(bench)
        names = bench.chip.violations.names()
        if names != expected:
            failed.append(f"{violation.name}: reported {sorted(names)}: {bench.chip.violations.lines()}")
    print("\n".join(failed) or f"{len(CASES)} misuses, each reported by its name")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
