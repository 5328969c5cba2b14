"""A page in Chromium without a screen, driven by the DevTools protocol over pipes: real key presses and pointers."""

from __future__ import annotations

import base64
import contextlib
import fcntl
import io
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FREE = 10
"""Numbers of the pipes' ends are at least this, so that they are not those that Chromium wants."""
END = b"\0"
"""Of a message."""


def browser() -> str | None:
    """The program, if there is one."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Page:
    """A page that is open. ``errors`` holds what its console says is wrong."""

    def __init__(self, to_browser: int, from_browser: int) -> None:
        self._to, self._from = os.fdopen(to_browser, "wb"), os.fdopen(from_browser, "rb", buffering=0)
        self._unread, self._count, self._session = b"", 0, ""
        self._is_loaded = False
        self.errors: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: object) -> dict[str, Any]:
        """What a method of the protocol answers. Events that come before are kept."""
        self._count += 1
        message: dict[str, object] = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        self._to.write(json.dumps(message).encode() + END)
        self._to.flush()
        while True:
            found = self._message()
            if found.get("id") == self._count:
                assert "error" not in found, f"{method}: {found['error']}"
                return found["result"]
            self._keep(found)

    def open(self, path: Path) -> None:
        """Open a file, and wait until all of it is there."""
        self._is_loaded = False
        begun = self.call("Page.navigate", url=path.as_uri())
        assert "errorText" not in begun, f"{path}: {begun['errorText']}"
        while not self._is_loaded:
            self._keep(self._message())

    def value(self, expression: str) -> Any:
        """What an expression of JavaScript gives."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def resize(self, width: int, height: int) -> None:
        """Make the window's inside so many pixels wide and high."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def drag(self, places: list[tuple[float, float]]) -> None:
        """Press the pointer at the first place, move it over the others, and let go."""
        kinds = ["mousePressed", *["mouseMoved"] * (len(places) - 1), "mouseReleased"]
        for kind, (x, y) in zip(kinds, [*places, places[-1]], strict=True):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def press(self, key: str) -> None:
        """Press a key and let it go."""
        code = {"ArrowLeft": 37, "ArrowRight": 39}[key]
        for kind in ("rawKeyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def picture(self) -> np.ndarray:
        """(h, w, 3) uint8: what the window shows."""
        data = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        return np.array(Image.open(io.BytesIO(data)).convert("RGB"))

    def _message(self) -> dict[str, Any]:
        while END not in self._unread:
            more = self._from.read(1 << 16)
            assert more, "Chromium has ended"
            self._unread += more
        first, _, self._unread = self._unread.partition(END)
        found: dict[str, Any] = json.loads(first)
        return found

    def _keep(self, event: dict[str, Any]) -> None:
        name, said = event.get("method"), event.get("params", {})
        self._is_loaded = self._is_loaded or name == "Page.loadEventFired"
        is_error = name == "Runtime.exceptionThrown"
        is_error = is_error or (name == "Runtime.consoleAPICalled" and said["type"] in ("error", "assert"))
        if is_error or (name == "Log.entryAdded" and said["entry"]["level"] == "error"):
            self.errors.append(json.dumps(said))


@contextlib.contextmanager
def new_page(program: str, profile: Path) -> Iterator[Page]:
    """A page in a browser of its own, which ends with it."""
    (its_in, to_browser), (from_browser, its_out) = os.pipe(), os.pipe()
    theirs = [fcntl.fcntl(end, fcntl.F_DUPFD, FREE) for end in (its_in, its_out)]
    os.close(its_in), os.close(its_out)
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-pipe"]
    command = [program, *options, f"--user-data-dir={profile}"]
    # Chromium reads from 3 and writes to 4.
    script = f'exec "$@" 3<&{theirs[0]} 4>&{theirs[1]}'
    whole, quiet = ["bash", "-c", script, "bash", *command], subprocess.DEVNULL
    process = subprocess.Popen(whole, pass_fds=theirs, stdout=quiet, stderr=quiet)
    for end in theirs:
        os.close(end)
    try:
        page = Page(to_browser, from_browser)
        yield page
        page.call("Browser.close")
    finally:
        process.terminate()
        process.wait(timeout=30)
