"""Looks at pages of `host-cal report` as a reader would, light and dark, at three widths, and prints what is wrong with each, as JSON.

Arguments: files. Result: {file: {"figures": [...], "findings": [...], "print_pages": n}}.
"""

import base64
import json
import pathlib
import re
import sys

from browser import Browser

WIDTHS = [390, 1000, 1600]
LOOK = (pathlib.Path(__file__).parent / "look_at_pages.js").read_text()
PICTURE = "document.querySelector('#scene canvas')?.toDataURL()"
SETTLED = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))"


def look_at(browser, path):
    url = pathlib.Path(path).resolve().as_uri()
    findings, figures = [], []
    for scheme in ["light", "dark"]:
        browser.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        for width in WIDTHS:
            where = f"{width} {scheme}: "
            browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
            if width == WIDTHS[0]:
                browser.open(url)
                findings += [where + words for words in troubles(browser, url)]
            browser.evaluate(SETTLED)
            look = browser.evaluate(LOOK)
            figures = look["figures"]
            findings += [where + words for words in look["findings"]]
            if look["dark"] != (scheme == "dark"):
                findings.append(where + "the page is " + ("dark" if look["dark"] else "light"))
    findings += turning(browser)
    findings += ["later: " + words for words in troubles(browser, url)]
    pdf = base64.b64decode(browser.ask("Page.printToPDF", printBackground=False)["data"])
    pages = len(re.findall(rb"/Type\s*/Page\b", pdf))
    browser.ask("Emulation.setEmulatedMedia", media="print")
    shown = browser.evaluate("[...document.querySelectorAll('#scene svg')].filter((svg) => svg.clientHeight > 50).length")
    browser.ask("Emulation.setEmulatedMedia", media="")
    if shown != 1:
        findings.append("print: the scene's drawing is not shown")
    return {"figures": figures, "findings": findings, "print_pages": pages}


def troubles(browser, url):
    """What the console and the network say since the page was opened."""
    for event in browser.events:
        method, about = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = about["exceptionDetails"]
            yield "exception: " + details.get("exception", {}).get("description", details["text"]).splitlines()[0]
        elif method == "Runtime.consoleAPICalled" and about["type"] in ("error", "warning", "assert"):
            yield "console: " + " ".join(str(part.get("value", part.get("description"))) for part in about["args"])
        elif method == "Log.entryAdded" and about["entry"]["level"] == "error":
            yield "log: " + about["entry"]["text"]
        elif method == "Network.requestWillBeSent" and about["request"]["url"].split("#")[0] != url:
            yield "request: " + about["request"]["url"]


def turning(browser):
    """Whether the scene turns under the mouse, a finger and the keys."""
    box = browser.evaluate(
        "(() => { const canvas = document.querySelector('#scene canvas'); if (!canvas) return null;"
        " canvas.scrollIntoView({ block: 'center' }); const { x, y, width, height } = canvas.getBoundingClientRect();"
        " return [x + width / 2, y + height / 2]; })()"
    )
    if box is None:
        return ["there is no scene to turn"]
    x, y = box

    def drag():
        mouse = dict(button="left", buttons=1, clickCount=1)
        browser.ask("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, **mouse)
        browser.ask("Input.dispatchMouseEvent", type="mouseMoved", x=x + 60, y=y + 20, **mouse)
        browser.ask("Input.dispatchMouseEvent", type="mouseReleased", x=x + 60, y=y + 20, **mouse)

    def touch():
        browser.ask("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
        for step in range(1, 5):
            browser.ask("Input.dispatchTouchEvent", type="touchMove", touchPoints=[{"x": x + 20 * step, "y": y}])
        browser.ask("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def press():
        browser.evaluate("document.querySelector('#scene canvas').focus()")
        browser.ask("Input.dispatchKeyEvent", type="keyDown", key="ArrowLeft", code="ArrowLeft", windowsVirtualKeyCode=37)

    findings = []
    for move in [drag, touch, press]:
        before = browser.evaluate(PICTURE)
        move()
        browser.evaluate(SETTLED)
        if browser.evaluate(PICTURE) == before:
            findings.append(f"the scene does not turn: {move.__name__}")
    return findings


def main():
    browser = Browser()
    try:
        print(json.dumps({path: look_at(browser, path) for path in sys.argv[1:]}, indent=1))
    finally:
        browser.close()


main()
