"""Headless Chromium driven over the DevTools protocol: a page is opened, asked and clicked in."""

import base64
import io
import itertools
import json
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import chromium
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from websockets.sync.client import connect

_OPTIONS = (
    "no-first-run",
    "disable-background-networking",
    "disable-sync",
    "mute-audio",
    "hide-scrollbars",
)
_LONG = 60.0  # s: a busy machine draws in software


class Page:
    """A page that is open."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._numbers = socket, itertools.count(1)

    def call(self, method: str, **parameters: Any) -> Any:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=_LONG))
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    def value(self, expression: str) -> Any:
        """Return what a JavaScript expression comes to."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def until(self, expression: str) -> Any:
        """Return the expression's value as soon as it is true."""
        end = time.monotonic() + _LONG
        while not (found := self.value(expression)):
            assert time.monotonic() < end, f"still not: {expression}"
            time.sleep(0.1)
        return found

    def click(self, x: float, y: float) -> None:
        for kind in ("mousePressed", "mouseReleased"):
            at = {"x": x, "y": y, "button": "left", "clickCount": 1}
            self.call("Input.dispatchMouseEvent", type=kind, **at)

    def picture(self, area: str = "document.body") -> NDArray[np.int_]:
        """Return the pixels of an element, (height, width, 3)."""
        box = self.value(f"(r => [r.x, r.y, r.width, r.height])({area}.getBoundingClientRect())")
        clip = dict(zip(("x", "y", "width", "height"), box, strict=True)) | {"scale": 1}
        png = base64.b64decode(self.call("Page.captureScreenshot", clip=clip)["data"])
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), int)

    def still_picture(self, area: str) -> NDArray[np.int_]:
        """Return the pixels of an element once they do not change any more."""
        end, before = time.monotonic() + _LONG, self.picture(area)
        while (np.abs((now := self.picture(area)) - before).max()) > 0:
            assert time.monotonic() < end, "the picture does not come to rest"
            before = now
            time.sleep(0.2)
        return before


@contextmanager
def opened(url: str, folder: Path) -> Iterator[Page]:
    """Open the page at ``url``, with a browser profile of its own in ``folder``."""
    gl = ("use-angle=swiftshader", "enable-unsafe-swiftshader")
    options = [f"--{option}" for option in (*_OPTIONS, *gl, "headless", "no-sandbox")]
    folder.mkdir(parents=True, exist_ok=True)
    process = subprocess.Popen(
        [
            str(chromium.PROGRAM),
            *options,
            *("--remote-debugging-port=0", f"--user-data-dir={folder}"),
            *("--window-size=1000,500", "about:blank"),
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        with connect(_address_of_page(folder), max_size=None) as socket:
            page = Page(socket)
            page.call("Page.navigate", url=url)
            yield page
    finally:
        process.terminate()
        process.wait(20)


def _address_of_page(folder: Path) -> str:
    end = time.monotonic() + _LONG
    while time.monotonic() < end:
        try:
            port = (folder / "DevToolsActivePort").read_text().split()[0]
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
                pages = [each for each in json.load(answer) if each["type"] == "page"]
            return str(pages[0]["webSocketDebuggerUrl"])
        except (OSError, IndexError):
            time.sleep(0.1)
    raise AssertionError("the browser did not start")
