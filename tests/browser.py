"""Headless Chromium, driven by the DevTools protocol over pipes: no package is needed for it."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
OPTIONS = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run")
SOON = 60.0
"""What a page does takes less than this many seconds, on a busy machine too."""

PIPES = (3, 4)
"""Descriptors that the browser reads from and writes to."""


class Browser:
    """One page in a headless browser, which lasts for a session of tests."""

    def __init__(self, writer: int, reader: int) -> None:
        self._writer, self._reader, self._buffer = writer, reader, b""
        self._count, self._session, self._context = 0, "", ""
        self.events: list[dict[str, Any]] = []
        self.begin_anew()

    def begin_anew(self) -> None:
        """Leave the page for a new one, which knows nothing of what was stored before."""
        self._session = ""
        if self._context:
            self.call("Target.disposeBrowserContext", browserContextId=self._context)
        self._context = self.call("Target.createBrowserContext")["browserContextId"]
        place = {"url": "about:blank", "browserContextId": self._context}
        target = self.call("Target.createTarget", **place)["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        self.events.clear()
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol, and return its result."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        self._send(json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive()
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return dict(answer["result"])
            self.events.append(answer)

    def _send(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._writer, data) :]

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            part = os.read(self._reader, 1 << 16)
            assert part, "the browser has ended"
            self._buffer += part
        text, _, self._buffer = self._buffer.partition(b"\0")
        return dict(json.loads(text))

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression of JavaScript, which is awaited."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, expression: str) -> None:
        """Wait until an expression holds."""
        end = time.monotonic() + SOON
        while not self.evaluate(expression):
            assert time.monotonic() < end, expression
            time.sleep(0.05)

    def resize(self, width: int, height: int, dark: bool = False) -> None:
        """Make the page so large, in CSS pixels, on a system that is dark or light."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            **{"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def open(self, page: Path, fragment: str = "") -> None:
        """Open a page from disk, and wait until it runs."""
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=page.as_uri() + fragment)
        self.until("document.documentElement?.dataset.ready !== undefined")

    def press(self, key: str) -> None:
        """Press and release a key."""
        text = {"text": key} if len(key) == 1 else {}
        codes = {
            " ": 32,
            "Tab": 9,
            "ArrowRight": 39,
            "ArrowLeft": 37,
            "Enter": 13,
            "+": 107,
            "0": 48,
        }
        code = {"windowsVirtualKeyCode": codes[key], "key": key}
        self.call("Input.dispatchKeyEvent", type="keyDown", **code, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", **code)

    def click(self, x: float, y: float) -> None:
        """Click with the mouse."""
        for kind, buttons in (("mousePressed", 1), ("mouseReleased", 0)):
            where = {"x": x, "y": y, "button": "left", "buttons": buttons, "clickCount": 1}
            self.call("Input.dispatchMouseEvent", type=kind, **where)

    def screenshot(self, path: Path, whole: bool = False) -> None:
        """Write what is seen as PNG; whole: also what is below."""
        picture = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(picture["data"]))

    def complaints(self) -> list[str]:
        """Return errors, warnings and addresses on the network that the page asked for."""
        complaints = []
        for event in self.events:
            parameters = event.get("params", {})
            if event.get("method") == "Runtime.exceptionThrown":
                complaints.append(str(parameters["exceptionDetails"]))
            if event.get("method") == "Log.entryAdded":
                complaints.append(str(parameters["entry"]))
            if event.get("method") == "Network.requestWillBeSent":
                address = parameters["request"]["url"]
                if not address.startswith(("file:", "about:", "data:", "blob:")):
                    complaints.append(address)
        return complaints


@contextlib.contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """Start Chromium with a profile in a folder; skip where there is none."""
    program = next((path for name in NAMES if (path := shutil.which(name))), None)
    if program is None:
        pytest.skip("Chromium is not installed, which shows pages here")
    asked, write = os.pipe()
    read, answered = os.pipe()
    options = [*OPTIONS, f"--user-data-dir={folder}", "--remote-debugging-pipe", "about:blank"]
    shell = f'exec {PIPES[0]}<&{asked} {PIPES[1]}>&{answered} "$0" "$@"'
    process = subprocess.Popen(
        ["bash", "-c", shell, program, *options],
        pass_fds=(asked, answered),
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    os.close(asked)
    os.close(answered)
    try:
        yield Browser(write, read)
    finally:
        os.close(write)  # the browser ends with its pipe
        os.close(read)
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
