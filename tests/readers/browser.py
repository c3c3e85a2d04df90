"""Chromium without a window, over its DevTools protocol by pipes: nothing but the standard library is needed."""

import json
import os
import subprocess
import tempfile


class Browser:
    """One browser with one page. The protocol's messages are JSON, each ended by a zero byte."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="browser-")
        to_browser, self.to = os.pipe()
        self.source, from_browser = os.pipe()
        command = 'exec chromium "$@" 3<&%d 4>&%d' % (to_browser, from_browser)
        arguments = [
            "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--hide-scrollbars",
            "--disable-background-networking", "--disable-component-update", "--disable-extensions",
            "--user-data-dir=" + self.folder.name, "--remote-debugging-pipe", "about:blank",
        ]
        self.process = subprocess.Popen(
            ["sh", "-c", command, "chromium", *arguments],
            pass_fds=(to_browser, from_browser), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        )
        os.close(to_browser)
        os.close(from_browser)
        self.left, self.number, self.events, self.session = b"", 0, [], None
        pages = self.ask("Target.getTargets")["targetInfos"]
        page = next(target for target in pages if target["type"] == "page")
        self.session = self.ask("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        for domain in ["Page", "Runtime", "Log", "Network"]:
            self.ask(domain + ".enable")

    def ask(self, method, **parameters):
        """Sends a command and waits for its answer; what happens meanwhile goes to `events`."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(method + ": " + json.dumps(answer["error"]))
                return answer["result"]
            self.events.append(answer)

    def receive(self):
        while b"\0" not in self.left:
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
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self.receive())

    def evaluate(self, expression):
        """The value of a JavaScript expression; a promise is waited for."""
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(json.dumps(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def close(self):
        self.process.terminate()
        self.process.wait()
        self.folder.cleanup()
