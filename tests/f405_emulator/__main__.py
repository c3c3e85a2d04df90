"""A board behind a socket.

    python -m f405_emulator ELF SOCKET [--start after-dfu]

Listens at SOCKET for the host's end of the serial line and runs the board, not faster than a real one. Commands come in as lines of
JSON, each answered by one:

    {"ring": {"joint": 0, "pulses_per_s": 400000, "high_ns": 1000}}      an index line begins to ring
    {"quiet": 0}                                                         and ends
    {"report": null}                                                     what happened so far
"""

import argparse
import json
import select
import socket
import sys
import time

from .chip import Chip, Start
from .image import Image
from .peripherals.exti import INTERRUPTS
from .peripherals.scs import FIRST
from .timeline import MS, S

TURN = MS
# A machine that cannot keep up makes the board slow and does not make it hurry afterwards.
HURRY = 20 * MS


class Pace:
    """Board's time against this machine's."""

    def __init__(self, timeline):
        self._timeline = timeline
        self._start = time.monotonic_ns() * 1000 - timeline.now

    def keep(self):
        behind = time.monotonic_ns() * 1000 - self._start - self._timeline.now
        if behind < -TURN:
            time.sleep(-behind / S)
        elif behind > HURRY:
            self._start += behind - HURRY


class Link:
    """The socket. Until somebody connects, what the board sends is lost."""

    def __init__(self, path):
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(path)
        self._listener.listen(1)
        self._listener.setblocking(False)
        self._peer = None

    def exchange(self, data):
        if self._peer is None:
            try:
                self._peer, _ = self._listener.accept()
            except BlockingIOError:
                return b""
        try:
            if data:
                self._peer.setblocking(True)
                self._peer.sendall(data)
            self._peer.setblocking(False)
            return self._peer.recv(4096)
        except (BlockingIOError, BrokenPipeError, ConnectionResetError):
            return b""


def report(chip):
    return {
        "now_s": chip.timeline.now / S,
        "violations": chip.violations.lines(),
        "is_dead": chip.core.is_dead,
        "resets": chip.resets,
        "sampling_periods": chip.tim7.updates,
        "missed_periods": chip.tim7.missed,
        "index_interrupts": sum(chip.taken[FIRST + interrupt] for interrupt in INTERRUPTS),
        "erases": chip.flash.erases,
        "flash_control": chip.flash.values["CR"],
    }


def obey(chip, line):
    [(name, value)] = json.loads(line).items()
    match name:
        case "ring":
            chip.outside.ring(**value)
            return {}
        case "quiet":
            chip.outside.quiet(value)
            return {}
        case "report":
            return report(chip)
        case _:
            return {"error": f"no command {name}"}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("elf")
    parser.add_argument("socket")
    parser.add_argument("--start", default=Start.POWER_ON.value, choices=[start.value for start in Start])
    arguments = parser.parse_args()
    link = Link(arguments.socket)
    chip = Chip(Image(arguments.elf), Start(arguments.start))
    pace = Pace(chip.timeline)
    while True:
        chip.run(TURN)
        chip.usart2.receive(link.exchange(chip.outside.take_link_bytes()))
        pace.keep()
        # A dead board has nothing more to do than to answer.
        if select.select([sys.stdin], [], [], None if chip.core.is_dead else 0)[0]:
            line = sys.stdin.readline()
            if not line:
                return
            print(json.dumps(obey(chip, line)), flush=True)


if __name__ == "__main__":
    main()
