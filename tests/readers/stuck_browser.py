"""Meets a browser that starts and never says a word: prints the error, and whether anything of it is still running."""

import os
import pathlib
import tempfile
import time

from browser import Browser

STUCK = """#!/bin/sh
sleep 600 &
echo $$ $! > "%s"
wait
"""


def is_running(process):
    try:
        # A zombie, which nobody here can wait for, has ended.
        return pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        numbers, browser = folder / "numbers", folder / "chromium"
        browser.write_text(STUCK % numbers)
        browser.chmod(0o755)
        os.environ["PATH"] = name + os.pathsep + os.environ["PATH"]
        try:
            Browser(patience_s=2.0)
        except TimeoutError as error:
            print(error)
        processes = numbers.read_text().split()
        until = time.monotonic() + 10.0
        while any(map(is_running, processes)) and time.monotonic() < until:
            time.sleep(0.02)
        print(len(processes), "started,", sum(map(is_running, processes)), "running")


main()
