"""Chromium without a window, over its DevTools protocol by pipes: nothing but the standard library is needed."""

import json
import os
import select
import signal
import subprocess
import tempfile
import time


class Browser:
    """One browser with one page. The protocol's messages are JSON, each ended by a zero byte."""

    def __init__(self, patience_s=120.0):
        """Raises TimeoutError, as all methods do, when the browser says nothing for so long; nothing is left running then."""
        self.patience_s, self.process = patience_s, None
        self.folder = tempfile.TemporaryDirectory(prefix="browser-", ignore_cleanup_errors=True)
        to_browser, self.to = os.pipe()
        self.source, from_browser = os.pipe()
        self.left, self.number, self.events, self.session = b"", 0, [], None
        try:
            try:
                self.start(to_browser, from_browser)
            finally:
                os.close(to_browser)
                os.close(from_browser)
            pages = self.ask("Target.getTargets")["targetInfos"]
            page = next(target for target in pages if target["type"] == "page")
            self.session = self.ask("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
            for domain in ["Page", "Runtime", "Log", "Network"]:
                self.ask(domain + ".enable")
        except BaseException:
            self.close()
            raise

    def start(self, to_browser, from_browser):
        command = 'exec chromium "$@" 3<&%d 4>&%d' % (to_browser, from_browser)
        arguments = [
            "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--hide-scrollbars",
            "--disable-background-networking", "--disable-component-update", "--disable-extensions",
            "--user-data-dir=" + self.folder.name, "--remote-debugging-pipe", "about:blank",
        ]
        # In a group of its own, so that its helpers end with it.
        self.process = subprocess.Popen(
            ["sh", "-c", command, "chromium", *arguments], start_new_session=True,
            pass_fds=(to_browser, from_browser), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        )

    def ask(self, method, **parameters):
        """Sends a command and waits for its answer; what happens meanwhile goes to `events`."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + self.patience_s
        while True:
            answer = self.receive(deadline, method)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(method + ": " + json.dumps(answer["error"]))
                return answer["result"]
            self.events.append(answer)

    def receive(self, deadline, awaited):
        while b"\0" not in self.left:
            rest_s = max(0.0, deadline - time.monotonic())
            if not select.select([self.source], [], [], rest_s)[0]:
                raise TimeoutError(f"the browser did not answer within {self.patience_s:g} s: {awaited}")
            piece = os.read(self.source, 1 << 20)
            if not piece:
                raise RuntimeError("the browser has gone")
            self.left += piece
        message, self.left = self.left.split(b"\0", 1)
        return json.loads(message)

    def open(self, url):
        """Loads a page and waits until all of it is there."""
        self.events.clear()
        self.ask("Page.navigate", url=url)
        deadline = time.monotonic() + self.patience_s
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self.receive(deadline, "Page.loadEventFired"))

    def evaluate(self, expression):
        """The value of a JavaScript expression; a promise is waited for."""
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(json.dumps(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def close(self):
        os.close(self.to)
        os.close(self.source)
        if self.process:
            # Whoever leads the group has not been waited for yet, so its number is still its own.
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        self.folder.cleanup()
