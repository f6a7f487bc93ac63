# SPDX-License-Identifier: Apache-2.0
"""Headless Chromium of the system, driven over its DevTools protocol."""

import base64
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
"""Program of the browser; None if it is not installed."""

MOST_TRIES = 2000
"""Largest number of times that the page is tested for a condition, however long a busy machine takes."""


class Page:
    """One page of the browser. Collects messages of the console, exceptions, and requests."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._number = 0
        self.problems: list[str] = []
        self.requests: list[str] = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Calls a method of the protocol and returns its result."""
        self._number += 1
        self._connection.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._connection.recv())
            if message.get("id") == self._number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                result: dict[str, Any] = message["result"]
                return result
            self._collect(message.get("method", ""), message.get("params", {}))

    def _collect(self, event: str, content: dict[str, Any]) -> None:
        if event == "Runtime.exceptionThrown":
            self.problems.append(str(content["exceptionDetails"]))
        elif event == "Runtime.consoleAPICalled" and content["type"] in ("error", "warning", "assert"):
            self.problems.append(str(content["args"]))
        elif event == "Log.entryAdded" and content["entry"]["level"] in ("error", "warning"):
            self.problems.append(str(content["entry"]))
        elif event == "Network.requestWillBeSent":
            self.requests.append(content["request"]["url"])

    def run(self, script: str) -> Any:
        """Returns the value of an expression in the page."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        return found["result"].get("value")

    def wait(self, condition: str) -> None:
        """Waits until an expression in the page is true."""
        for _ in range(MOST_TRIES):
            if self.run(condition) is True:
                return
            time.sleep(0.05)
        raise AssertionError(f"not true: {condition}; {self.problems}")

    def box(self, element: str) -> list[float]:
        """Returns left, top, right and bottom of the element with this id in the window [px]."""
        found: list[float] = self.run(
            "(b => [b.left, b.top, b.right, b.bottom])"
            f"(document.getElementById({element!r}).getBoundingClientRect())"
        )
        return found

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Moves the mouse with its left button pressed, from one place in the window to another [px]."""
        self._mouse("mouseMoved", start, buttons=0)
        self._mouse("mousePressed", start, button="left", clickCount=1)
        for share in (0.3, 0.6, 1.0):
            x, y = (a + share * (b - a) for a, b in zip(start, end, strict=True))
            self._mouse("mouseMoved", (x, y), button="left", buttons=1)
        self._mouse("mouseReleased", end, button="left", clickCount=1)

    def _mouse(self, kind: str, at: tuple[float, float], **button: Any) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], **button)

    def click(self, selector: str) -> None:
        """Scrolls to the first element of a CSS selector and clicks its middle."""
        self.run(f"document.querySelector({selector!r}).scrollIntoView({{block: 'center'}})")
        x, y = self.run(
            "(b => [b.left + b.width / 2, b.top + b.height / 2])"
            f"(document.querySelector({selector!r}).getBoundingClientRect())"
        )
        self._mouse("mousePressed", (x, y), button="left", clickCount=1)
        self._mouse("mouseReleased", (x, y), button="left", clickCount=1)

    def press(self, key: str, *, control: bool = False) -> None:
        """Presses and releases a key of the keyboard, such as Tab, Enter or ArrowRight."""
        code = {"Tab": 9, "Enter": 13, "ArrowRight": 39, "ArrowDown": 40}.get(key, ord(key[0].upper()))
        given = {"key": key, "windowsVirtualKeyCode": code, "modifiers": 2 if control else 0}
        text = {"text": "\r"} if key == "Enter" else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", **given, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", **given)

    def type(self, text: str) -> None:
        """Types text into the element with the focus."""
        self.call("Input.insertText", text=text)

    def drop(self, file: Path, at: tuple[float, float] = (200.0, 200.0)) -> None:
        """Drops a file on a place in the window [px]."""
        data = {"items": [], "files": [str(file)], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.call("Input.dispatchDragEvent", type=kind, x=at[0], y=at[1], data=data)

    def choose(self, element: str, value: str) -> None:
        """Chooses a value of the select element with this id."""
        self.run(
            f"(e => {{ e.value = {value!r}; e.dispatchEvent(new Event('change', {{bubbles: true}})); }})"
            f"(document.getElementById({element!r}))"
        )

    def downloads_to(self, folder: Path) -> None:
        """Writes downloads to a folder."""
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def media(self, *, dark: bool, paper: bool = False) -> None:
        """Sets the colour scheme that the reader prefers, and the screen or paper."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", media="print" if paper else "", features=[scheme])

    def size(self, width: int, height: int, *, phone: bool = False) -> None:
        """Sets the size of the window [px]; a phone has a finger in place of a mouse."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=phone,
        )

    def open(self, file: Path) -> None:
        """Opens a file and waits until its charts are drawn."""
        self.call("Page.navigate", url=file.resolve().as_uri())
        self.wait("document.documentElement.dataset.charts === 'drawn'")
        time.sleep(0.5)  # the charts are laid out again when their size is known

    def screenshot(self, to: Path, *, whole: bool = False) -> bytes:
        """Writes a picture of the window, or of the whole page, and returns it (PNG)."""
        shot = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        data = base64.b64decode(shot["data"])
        to.write_bytes(data)
        return data

    def print(self, to: Path) -> bytes:
        """Prints the page on A4 and returns the file (PDF)."""
        shot = self.call("Page.printToPDF", paperWidth=8.27, paperHeight=11.69, preferCSSPageSize=True)
        data = base64.b64decode(shot["data"])
        to.write_bytes(data)
        return data


@contextmanager
def chromium(profile: Path) -> Iterator[Page]:
    """Starts the browser with an empty profile and yields its page."""
    assert PROGRAM is not None
    command = [
        PROGRAM,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--hide-scrollbars",
    ]
    command += [
        "--disable-dev-shm-usage",
        "--remote-debugging-port=0",
        f"--user-data-dir={profile}",
        "about:blank",
    ]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            address = _address(profile, process)
            with connect(address, max_size=None, open_timeout=None, ping_interval=None) as connection:
                yield Page(connection)
        finally:
            process.terminate()


def _address(profile: Path, process: subprocess.Popen[bytes]) -> str:
    """Returns the address of the first page of the browser."""
    from urllib.request import urlopen

    file = profile / "DevToolsActivePort"
    while process.poll() is None:
        if file.exists() and file.read_text(encoding="utf-8").count("\n"):
            port = file.read_text(encoding="utf-8").split("\n")[0]
            with urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
                pages = [each for each in json.load(answer) if each["type"] == "page"]
            if pages:
                return str(pages[0]["webSocketDebuggerUrl"])
        time.sleep(0.05)
    raise AssertionError(f"{PROGRAM} did not start")
