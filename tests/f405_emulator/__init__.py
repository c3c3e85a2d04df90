"""A strict emulator of the STM32F405 as the shipped image sees it: the image byte for byte on an emulated Cortex-M4F, and a model of
each peripheral that it touches. What the reference manual (RM0090) forbids, or leaves open, is a violation; see `violations.py`.

    board.py        the chip put together, time, resets; board.Start is how it comes to run
    core.py         the processor: instructions by unicorn, exceptions by hand
    bus.py          from an address to a peripheral's register
    peripheral.py   what all peripherals have: registers, a clock, widths of access
    peripherals/    one file a kind
    outside.py      what is wired to the chip
    misuse.py       a wrong program for every violation
    __main__.py     a board behind a socket, for the tests in Rust

What it does not do: an instruction takes one cycle, so durations are estimates; interrupts arrive between blocks of instructions; no
MPU, no bus contention, no boot loader's ROM; what no program of this project touches is not there, and touching it is a violation.
"""
