"""The chip put together: memory, processor, peripherals, resets."""

import random
import struct
from collections import Counter
from enum import Enum

from unicorn import UC_PROT_EXEC, UC_PROT_READ

from .bus import Bus
from .core import Core
from .outside import Outside
from .peripherals.adc import Adc1
from .peripherals.dma import Dma1, Dma2
from .peripherals.exti import Exti, Syscfg
from .peripherals.flash import SLOTS, Flash
from .peripherals.gpio import GpioA, GpioB, GpioC
from .peripherals.iwdg import Dbgmcu, Iwdg
from .peripherals.rcc import Pwr, Rcc
from .peripherals.scs import FIRST, Scs
from .peripherals.timers import ENCODER_TIMERS, Tim7
from .peripherals.usart import Usart2
from .timeline import MS, S, US, Timeline
from .violations import Violation, Violations

FLASH = range(0x0800_0000, 0x0810_0000)
SRAM = range(0x2000_0000, 0x2002_0000)
# Read-only memory of the factory: the boot loader is not in it here, the unique number is.
SYSTEM = range(0x1FFF_7800, 0x1FFF_7C00)
UNIQUE_ID = 0x1FFF_7A10
MAPPED_BYTES = 0x1000

# Of the boot loader's USB.
OTG_FS_INTERRUPT, OTG_FS_CLOCK = 67, 1 << 7
MEMRMP_SYSTEM = 1


class Start(Enum):
    """How the image comes to run."""

    POWER_ON = "power-on"
    AFTER_DFU = "after-dfu"
    # With other memory than the flash at 0 after every reset, which this chip never does: a program must not reset itself for ever.
    ALWAYS_REMAPPED = "always-remapped"


class Chip:
    """An STM32F405, and what is wired to it."""

    def __init__(self, image, start=Start.POWER_ON):
        self.timeline = Timeline()
        self.violations = Violations()
        self.symbols = image
        self.taken = Counter()
        self.resets = []
        self._start = start
        self._wants_reset = None
        self._usb = None
        self.core = Core(self)
        self._make_peripherals()
        self.outside = Outside(self)
        self._map_memory(image)
        self.violations.where = lambda: f" in {self.core.where()}"
        self._start_up("power-on")

    def _make_peripherals(self):
        self.peripherals = []
        self.rcc = self._add(Rcc)
        self.flash = self._add(Flash)
        self.scs = self._add(Scs)
        self.syscfg = self._add(Syscfg)
        self.exti = self._add(Exti)
        self.gpio = {port: self._add(kind) for port, kind in (("A", GpioA), ("B", GpioB), ("C", GpioC))}
        self.dma1, self.dma2 = self._add(Dma1), self._add(Dma2)
        self.usart2 = self._add(Usart2)
        self.adc1 = self._add(Adc1)
        self.tim7 = self._add(Tim7)
        self.iwdg = self._add(Iwdg)
        for kind in (Pwr, Dbgmcu, *ENCODER_TIMERS):
            self._add(kind)

    def _add(self, kind):
        peripheral = kind(self)
        self.peripherals.append(peripheral)
        return peripheral

    def _map_memory(self, image):
        uc, read_only = self.core.uc, UC_PROT_READ | UC_PROT_EXEC
        uc.mem_map(FLASH.start, SLOTS.start - FLASH.start, read_only)
        uc.mem_map(SLOTS.stop, FLASH.stop - SLOTS.stop, read_only)
        uc.mmio_map(SLOTS.start, len(SLOTS), self.flash.read_slots, None, self.flash.write_slots, None)
        uc.mem_map(SRAM.start, len(SRAM))
        uc.mem_map(SYSTEM.start & ~(MAPPED_BYTES - 1), MAPPED_BYTES, UC_PROT_READ)
        uc.mem_write(UNIQUE_ID, bytes(range(1, 13)))
        for sectors in ((FLASH.start, SLOTS.start), (SLOTS.stop, FLASH.stop)):
            uc.mem_write(sectors[0], b"\xff" * (sectors[1] - sectors[0]))
        for address, data in image.segments:
            uc.mem_write(address, data)
        # What memory holds when the power comes is anything.
        uc.mem_write(SRAM.start, random.Random(405).randbytes(len(SRAM)))
        bus = Bus(self)
        for peripheral in self.peripherals:
            bus.connect(peripheral)
        bus.map(uc)

    # ---- running

    def run(self, duration):
        """Until so much time has passed, or the processor can go no further."""
        end = self.timeline.now + duration
        while self.timeline.now < end and not self.core.is_dead:
            self.timeline.run_due()
            if self._wants_reset:
                self._start_up(self._wants_reset)
            due = self.timeline.next()
            until = end if due is None else min(end, due)
            self.core.run(max(until, self.timeline.now + 1))
            if self._wants_reset:
                self._start_up(self._wants_reset)
            elif self.core.sleeps:
                self.timeline.pass_by(max(0, until - self.timeline.now))

    def vector(self, number):
        """Address of an exception's handler; None, and a violation, when the table is not the program's."""
        table = self.scs.values["VTOR"]
        if table == 0 and self.syscfg.is_flash_at_zero():
            table = FLASH.start
        if table != FLASH.start:
            source = "the boot loader's memory at 0" if table == 0 else f"{table:#x}"
            self.violations.add(Violation.FOREIGN_VECTOR, f"exception {number} from {source}")
            return None
        return struct.unpack("<I", self.core.uc.mem_read(table + 4 * number, 4))[0]

    def on_return(self, number):
        """From the handler of an exception."""
        self.exti.on_return(number - FIRST)

    # ---- resets

    def request_reset(self, cause):
        """At the next block: nothing is reset under a running instruction."""
        self._wants_reset = self._wants_reset or cause
        self.core.stop()

    def _start_up(self, cause):
        self._wants_reset = None
        is_power_on = cause == "power-on"
        if not is_power_on:
            self.resets.append({"at_s": self.timeline.now / S, "cause": cause})
        for peripheral in self.peripherals:
            peripheral.reset()
        self.timeline.cancel(self._usb)
        self.rcc.note_reset(cause)
        stack, entry = struct.unpack("<II", self.core.uc.mem_read(FLASH.start, 8))
        self.core.reset(stack, entry)
        if self._start == Start.AFTER_DFU and is_power_on:
            self._leave_as_boot_loader()
        elif self._start == Start.ALWAYS_REMAPPED:
            self.syscfg.values["MEMRMP"] = MEMRMP_SYSTEM

    def _leave_as_boot_loader(self):
        """What the boot loader leaves behind: its memory at 0, clocks from the crystal's PLL, USB with an interrupt on its way."""
        self.syscfg.values["MEMRMP"] = MEMRMP_SYSTEM
        self.flash.values["ACR"] = 5
        self.rcc.values["PLLCFGR"] = 0x0740_2A04
        for enabled in (1 << 16, 1 << 24):
            self.rcc.write_cr(self.rcc.values["CR"] | enabled)
            self.timeline.pass_by(5 * MS)
        self.rcc.write_cfgr(2 | 5 << 10 | 4 << 13)
        self.rcc.values["AHB1ENR"] |= 0xF
        self.rcc.values["AHB2ENR"] |= OTG_FS_CLOCK
        self.scs.enabled.add(FIRST + OTG_FS_INTERRUPT)
        self._usb = self.timeline.after(50 * US, lambda: self.scs.request(OTG_FS_INTERRUPT))
        self.scs.write(0x014, 4, 83_999)
        self.scs.write(0x010, 4, 7)
