"""Reset and clock control, with the power controller that it needs."""

from ..peripheral import Peripheral, Register
from ..timeline import S, US
from ..violations import Violation

HSI_HZ = 16_000_000
HSE_HZ = 8_000_000
HSION, HSEON, PLLON = 1 << 0, 1 << 16, 1 << 24
# A ready bit stands above its enable bit. Typical start-up times (datasheet).
START_UP = {HSION: 2 * US, HSEON: 2_000 * US, PLLON: 100 * US}
SW_HSI, SW_HSE, SW_PLL = range(3)

# RM0090, 7.2; the datasheet's limits at 2.7 V and more.
SYSCLK_MAX_HZ, AHB_PER_WAIT_STATE_HZ = 168_000_000, 30_000_000
APB1_MAX_HZ, APB2_MAX_HZ = 42_000_000, 84_000_000
VCO_IN_HZ, VCO_OUT_HZ = (950_000, 2_100_000), (100_000_000, 432_000_000)

RMVF, BORRSTF, PINRSTF, PORRSTF, SFTRSTF, IWDGRSTF = (1 << bit for bit in (24, 25, 26, 27, 28, 29))
FLAGS = {"power-on": PORRSTF | BORRSTF | PINRSTF, "pin": PINRSTF, "software": SFTRSTF | PINRSTF, "watchdog": IWDGRSTF | PINRSTF}


class Rcc(Peripheral):
    NAME = "RCC"
    BASE = 0x4002_3800
    WIDTHS = (1, 2, 4)
    REGISTERS = {
        0x00: Register("CR", 0x83, 0x050D_00F9),
        0x04: Register("PLLCFGR", 0x2400_3010, 0x0F43_7FFF),
        0x08: Register("CFGR", 0, 0xFFFF_FCF3),
        0x10: Register("AHB1RSTR", 0, 0x2260_11FF),
        0x20: Register("APB1RSTR", 0, 0x36FE_C9FF),
        0x24: Register("APB2RSTR", 0, 0x0007_5933),
        0x30: Register("AHB1ENR", 0x0010_0000, 0x7E7C_11FF),
        0x34: Register("AHB2ENR", 0, 0xF1),
        0x40: Register("APB1ENR", 0, 0x36FE_C9FF),
        0x44: Register("APB2ENR", 0, 0x0007_5F33),
        0x74: Register("CSR", 0, 0x0100_0001),
    }

    def __init__(self, chip):
        # Outlive resets.
        self.flags = 0
        super().__init__(chip)

    def reset(self):
        super().reset()
        self._ready_at = {HSION: 0}
        self._update()

    def note_reset(self, cause):
        self.flags |= FLAGS[cause]

    # ---- clocks

    def _update(self):
        self.sysclk_hz = self._source_hz()
        hpre = self.values["CFGR"] >> 4 & 15
        self.ahb_hz = self.sysclk_hz // ([2, 4, 8, 16, 64, 128, 256, 512][hpre & 7] if hpre & 8 else 1)
        self.apb1_hz, self.apb1_timer_hz = self._bus_hz(10)
        self.apb2_hz, self.apb2_timer_hz = self._bus_hz(13)
        # Picoseconds an instruction.
        self.cycle = S // self.ahb_hz

    def _source_hz(self):
        switch = self.values["CFGR"] & 3
        return {SW_HSI: HSI_HZ, SW_HSE: HSE_HZ}.get(switch) or self._pll()[2]

    def _bus_hz(self, shift):
        pre = self.values["CFGR"] >> shift & 7
        divider = 2 << (pre & 3) if pre & 4 else 1
        return self.ahb_hz // divider, self.ahb_hz // divider * (1 if divider == 1 else 2)

    def _pll(self):
        """Into the oscillator, out of it, and the PLL's output."""
        factors = self.values["PLLCFGR"]
        source = HSE_HZ if factors >> 22 & 1 else HSI_HZ
        into = source // max(1, factors & 63)
        out = into * (factors >> 6 & 511)
        return into, out, max(1, out // (2 * (factors >> 16 & 3) + 2))

    def _is_ready(self, enable):
        return self.chip.timeline.now >= self._ready_at.get(enable, S * S)

    def read_cr(self):
        ready = sum(enable << 1 for enable in START_UP if self._is_ready(enable))
        return self.values["CR"] & ~(HSION << 1) | ready

    def write_cr(self, value):
        switched_on = value & ~self.values["CR"]
        if switched_on & PLLON:
            self._check_pll()
        self.values["CR"] = value
        for enable, duration in START_UP.items():
            if not value & enable:
                self._ready_at.pop(enable, None)
            elif switched_on & enable:
                self._ready_at[enable] = self.chip.timeline.now + duration

    def _check_pll(self):
        into, out, _ = self._pll()
        if not VCO_IN_HZ[0] <= into <= VCO_IN_HZ[1] or not VCO_OUT_HZ[0] <= out <= VCO_OUT_HZ[1]:
            self.violation(Violation.CLOCK_LIMIT, f"PLL of {into} Hz to {out} Hz")
        source = HSEON if self.values["PLLCFGR"] >> 22 & 1 else HSION
        if not self._is_ready(source):
            self.violation(Violation.CLOCK_NOT_READY, "PLL switched on before its source is ready")

    def write_pllcfgr(self, value):
        if self.values["CR"] & PLLON:
            self.violation(Violation.PLL_CHANGED_WHILE_ON, f"PLLCFGR {value:#x}")
        self.values["PLLCFGR"] = value

    def read_cfgr(self):
        return self.values["CFGR"] | (self.values["CFGR"] & 3) << 2

    def write_cfgr(self, value):
        if not self._is_ready({SW_HSI: HSION, SW_HSE: HSEON}.get(value & 3, PLLON)):
            self.violation(Violation.CLOCK_NOT_READY, f"CFGR {value:#x}")
        self.values["CFGR"] = value
        self._update()
        for name, hz, limit in (
            ("SYSCLK", self.sysclk_hz, SYSCLK_MAX_HZ),
            ("APB1", self.apb1_hz, APB1_MAX_HZ),
            ("APB2", self.apb2_hz, APB2_MAX_HZ),
        ):
            if hz > limit:
                self.violation(Violation.CLOCK_LIMIT, f"{name} at {hz} Hz")
        self.check_wait_states(self.chip.flash.wait_states())

    def check_wait_states(self, wait_states):
        if self.ahb_hz > AHB_PER_WAIT_STATE_HZ * (wait_states + 1):
            self.violation(Violation.WAIT_STATES, f"{wait_states} at {self.ahb_hz} Hz")

    # ---- resets

    def read_csr(self):
        return self.values["CSR"] | (self.values["CSR"] & 1) << 1 | self.flags

    def write_csr(self, value):
        if value & RMVF:
            self.flags = 0
        self.values["CSR"] = value & ~RMVF

    def write_ahb1rstr(self, value):
        self._reset_peripherals("AHB1", value)

    def write_apb1rstr(self, value):
        self._reset_peripherals("APB1", value)

    def write_apb2rstr(self, value):
        self._reset_peripherals("APB2", value)

    def _reset_peripherals(self, bus, value):
        self.values[f"{bus}RSTR"] = value
        for peripheral in self.chip.peripherals:
            if peripheral.CLOCK and peripheral.CLOCK[0] == f"{bus}ENR" and value >> peripheral.CLOCK[1] & 1:
                peripheral.reset()


class Pwr(Peripheral):
    NAME = "PWR"
    BASE = 0x4000_7000
    CLOCK = ("APB1ENR", 28)
    WIDTHS = (2, 4)
    REGISTERS = {0x00: Register("CR", 0x4000, 0x43FF), 0x04: Register("CSR", 0, 0x310)}
