"""The processor: a Cortex-M4F. Unicorn executes its instructions; exceptions, which it does not have for this kind, are made here.

Time: a callback at the beginning of each block of instructions adds one cycle an instruction, and ends the run when something is due.
"""

import struct
from dataclasses import dataclass

from unicorn import (
    UC_ARCH_ARM,
    UC_HOOK_BLOCK,
    UC_HOOK_INTR,
    UC_HOOK_MEM_INVALID,
    UC_MEM_WRITE_PROT,
    UC_MODE_MCLASS,
    UC_MODE_THUMB,
    Uc,
    UcError,
)
from unicorn import arm_const as arm

from .violations import Violation

HARD_FAULT = 3
# Above everything that can be given a priority.
HARD_FAULT_PRIORITY = -1
THREAD_PRIORITY = 256

STACKED = [arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3, arm.UC_ARM_REG_R12, arm.UC_ARM_REG_LR]
STACKED_FLOATS = [arm.UC_ARM_REG_S0 + i for i in range(16)] + [arm.UC_ARM_REG_FPSCR]
EXCEPTION_CYCLES = 12
# Unicorn's number for a branch to an EXC_RETURN value.
EXCEPTION_RETURN = 8
FPCA = 4  # of CONTROL: floating point was used
IT_STATE = 0x0600_FC00  # of XPSR: within an if-then block
ALIGNED = 1 << 9  # of a stacked XPSR: the stack was moved by a word
THUMB = 1 << 24
WFI = 0xBF30
# Where no instruction ever is.
NOWHERE = 0xFFFF_FFFE
# While an interrupt is held off by PRIMASK or BASEPRI, it is looked at again after so many instructions.
HELD_OFF_INSTRUCTIONS = 32


@dataclass
class Active:
    """An exception that is being served."""

    number: int
    priority: int
    has_floats: bool


class Core:
    """Registers, memory and exceptions."""

    def __init__(self, chip):
        self._chip = chip
        self._timeline = chip.timeline
        self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        self.uc.hook_add(UC_HOOK_BLOCK, self._on_block)
        self.uc.hook_add(UC_HOOK_INTR, self._on_interrupt)
        self.uc.hook_add(UC_HOOK_MEM_INVALID, self._on_invalid)
        self._instructions = {}
        self.active = []
        self.pc = 0
        # Set by whoever wants the run to end at the next block.
        self.stop_at = 0
        self.sleeps = False
        self.is_dead = False
        self._returns = False
        self._fault = None

    def reset(self, stack, entry):
        write = self.uc.reg_write
        for i in range(13):
            write(arm.UC_ARM_REG_R0 + i, 0xDEAD_0000 + i)
        for register, value in (
            (arm.UC_ARM_REG_XPSR, THUMB),
            (arm.UC_ARM_REG_CONTROL, 0),
            (arm.UC_ARM_REG_PRIMASK, 0),
            (arm.UC_ARM_REG_BASEPRI, 0),
            (arm.UC_ARM_REG_SP, stack),
            (arm.UC_ARM_REG_LR, 0xFFFF_FFFF),
        ):
            write(register, value)
        self.active.clear()
        self.pc = entry & ~1
        self.sleeps = self._returns = False
        self._fault = None

    # ---- instructions

    def run(self, until):
        """Until a time, a sleep, or a call of `stop`."""
        held_off = self._take_interrupt()
        if self.sleeps or self.is_dead:
            return
        if held_off:
            until = min(until, self._timeline.now + HELD_OFF_INSTRUCTIONS * self._chip.rcc.cycle)
        self.stop_at = until
        error = None
        try:
            self.uc.emu_start(self.pc | 1, NOWHERE)
        except UcError as uc_error:
            error = str(uc_error)
        self.pc = self.uc.reg_read(arm.UC_ARM_REG_PC) & ~1
        if self._returns:
            self._returns = False
            self._leave()
        elif error or self._fault:
            self._hard_fault(error)
        elif self._timeline.now < self.stop_at:
            self.sleeps = self._is_behind_sleep()

    def stop(self):
        """Ends the run at the next block: a stop inside of an access would have unicorn make that access again."""
        self.stop_at = self._timeline.now

    def where(self):
        return self._chip.symbols.name(self.uc.reg_read(arm.UC_ARM_REG_PC))

    def _on_block(self, uc, address, size, _):
        timeline = self._timeline
        if timeline.now >= self.stop_at:
            uc.emu_stop()
            return
        count = self._instructions.get((address, size))
        if count is None:
            count = self._instructions[address, size] = self._count(address, size)
        timeline.now += count * self._chip.rcc.cycle

    def _count(self, address, size):
        """Instructions of a block: each has one or two half-words."""
        words = struct.unpack(f"<{size // 2}H", self.uc.mem_read(address, size // 2 * 2))
        at = count = 0
        while at < len(words):
            at += 2 if words[at] >> 11 >= 0b11101 else 1
            count += 1
        return count

    def _is_behind_sleep(self):
        return bytes(self.uc.mem_read(self.pc - 2, 2)) == WFI.to_bytes(2, "little")

    def _on_interrupt(self, uc, number, _):
        if number == EXCEPTION_RETURN:
            self._returns = True
        else:
            self._fault = (Violation.UNDEFINED_INSTRUCTION, f"exception {number} of unicorn")
        uc.emu_stop()

    def _on_invalid(self, _uc, kind, address, _size, _value, _):
        if kind == UC_MEM_WRITE_PROT:
            self._chip.flash.write_to_program(address)
            self._fault = ()
        else:
            self._fault = (Violation.OUTSIDE_MEMORY, f"{address:#010x}")
        return False

    # ---- exceptions

    def _take_interrupt(self):
        """Enters the most urgent interrupt. Whether one is held off by a mask."""
        pending = self._chip.scs.most_urgent()
        if pending is None:
            return False
        # A pending interrupt ends a sleep, masked or not.
        self.sleeps = False
        priority, number = pending
        if priority >= min((active.priority for active in self.active), default=THREAD_PRIORITY):
            return False
        read = self.uc.reg_read
        base = read(arm.UC_ARM_REG_BASEPRI)
        if read(arm.UC_ARM_REG_PRIMASK) & 1 or base and priority >= base or read(arm.UC_ARM_REG_XPSR) & IT_STATE:
            return True
        self._chip.scs.acknowledge(number)
        self._enter(number, priority)
        return self._take_interrupt()

    def _enter(self, number, priority):
        handler = self._chip.vector(number)
        if handler is None:
            self.is_dead = True
            return
        uc = self.uc
        has_floats = bool(uc.reg_read(arm.UC_ARM_REG_CONTROL) & FPCA)
        stack = uc.reg_read(arm.UC_ARM_REG_SP)
        xpsr = uc.reg_read(arm.UC_ARM_REG_XPSR)
        words = list(uc.reg_read_batch(STACKED))
        words += [self.pc, xpsr & ~ALIGNED | THUMB | (ALIGNED if stack & 4 else 0)]
        if has_floats:
            words += [*uc.reg_read_batch(STACKED_FLOATS), 0]
        frame = stack - 4 * len(words) & ~7
        try:
            uc.mem_write(frame, struct.pack(f"<{len(words)}I", *words))
        except UcError:
            self._chip.violations.add(Violation.OUTSIDE_MEMORY, f"stack at {frame:#010x}")
            if number != HARD_FAULT:
                uc.reg_write(arm.UC_ARM_REG_SP, frame)
                self._enter(HARD_FAULT, HARD_FAULT_PRIORITY)
                return
            # The processor enters this handler all the same.
        uc.reg_write(arm.UC_ARM_REG_SP, frame)
        # EXC_RETURN: to a handler or to the main program, with or without the floats.
        uc.reg_write(arm.UC_ARM_REG_LR, (0xFFFF_FFF1 if self.active else 0xFFFF_FFF9) & (~0x10 if has_floats else ~0))
        uc.reg_write(arm.UC_ARM_REG_CONTROL, 0)
        uc.reg_write(arm.UC_ARM_REG_XPSR, THUMB | number)
        self.active.append(Active(number, priority, has_floats))
        self._chip.taken[number] += 1
        self.pc = handler & ~1
        self._timeline.now += EXCEPTION_CYCLES * self._chip.rcc.cycle

    def _leave(self):
        uc = self.uc
        active = self.active.pop()
        count = 26 if active.has_floats else 8
        stack = uc.reg_read(arm.UC_ARM_REG_SP)
        words = struct.unpack(f"<{count}I", uc.mem_read(stack, 4 * count))
        uc.reg_write_batch(list(zip(STACKED, words)))
        if active.has_floats:
            uc.reg_write_batch(list(zip(STACKED_FLOATS, words[8:])))
        self.pc = words[6] & ~1
        xpsr = words[7]
        uc.reg_write(arm.UC_ARM_REG_XPSR, xpsr & ~ALIGNED)
        uc.reg_write(arm.UC_ARM_REG_CONTROL, FPCA if active.has_floats else 0)
        uc.reg_write(arm.UC_ARM_REG_SP, stack + 4 * count + (4 if xpsr & ALIGNED else 0))
        self._timeline.now += EXCEPTION_CYCLES * self._chip.rcc.cycle
        self._chip.on_return(active.number)

    def _hard_fault(self, error):
        violation = self._fault if self._fault is not None else (Violation.UNDEFINED_INSTRUCTION, error)
        self._fault = None
        if violation:
            self._chip.violations.add(*violation)
        if any(active.number == HARD_FAULT for active in self.active):
            self._chip.violations.add(Violation.LOCKUP, "")
            self.is_dead = True
        else:
            self._enter(HARD_FAULT, HARD_FAULT_PRIORITY)
