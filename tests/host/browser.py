"""A headless Chromium, driven over its debugging protocol: what a page asks for, says and looks like."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from websockets.sync.client import ClientConnection, connect

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
PATIENCE = 60.0
"""Seconds to wait for what must come."""


_FAULTS = """axe.run(document, {resultTypes: ['violations']}).then((told) =>
    told.violations.flatMap((one) => one.nodes.map((node) => one.help + ': ' + node.html.slice(0, 120))))"""


class Tab:
    """The one tab of a browser.

    Attributes
    ----------
    asked : list of str
        Addresses of all that was asked for.
    said : list of str
        What was written on the console, and errors.
    """

    def __init__(self, socket: ClientConnection) -> None:
        self._socket, self._number = socket, 0
        self.asked: list[str] = []
        self.said: list[str] = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Carry out a method of the protocol; return its result."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(PATIENCE))
            if message.get("id") == self._number:
                assert "error" not in message, message
                result: dict[str, Any] = message["result"]
                return result
            self._note(message["method"], message["params"])

    def open(self, address: str) -> None:
        """Go to a page."""
        self.call("Page.navigate", url=address)

    def show(self, page: Path, width: int, *, dark: bool = False) -> None:
        """Open a file in a window of some width; the records of what is asked for and said begin anew."""
        self.asked.clear()
        self.said.clear()
        self.window(width, 900, dark=dark)
        self.open(page.as_uri())
        self.until(f"document.readyState === 'complete' && location.href === '{page.as_uri()}'")

    def is_quiet(self, page: Path) -> bool:
        """Tell whether a page asked for nothing but itself, said nothing, and does not stick out of the window."""
        inside = self.value("document.documentElement.scrollWidth <= innerWidth")
        return bool(inside) and self.asked == [page.as_uri()] and self.said == []

    def value(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        return self.call("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def faults(self) -> list[str]:
        """Return what keeps people from reading the page, by the rules of axe-core: what is wrong, and where."""
        script = Path(str(files("axe_core_python") / "axe.min.js")).read_text(encoding="utf-8")
        self.call("Runtime.evaluate", expression=script)
        told = self.call("Runtime.evaluate", expression=_FAULTS, awaitPromise=True, returnByValue=True)
        return [str(one) for one in told["result"]["value"]]

    def until(self, expression: str) -> None:
        """Wait until an expression in the page is true."""
        end = time.monotonic() + PATIENCE
        while not self.value(expression):
            assert time.monotonic() < end, f"{expression} must become true; the console says {self.said}"
            time.sleep(0.02)

    def window(self, width: int, height: int, *, dark: bool = False) -> None:
        """Set the size of the window and the colour scheme."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600
        )

    def picture(self, path: Path) -> None:
        """Save the whole page as PNG."""
        shown = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shown["data"]))

    def key(self, name: str) -> None:
        """Press a key."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=name, code=name)

    def _note(self, method: str, parameters: dict[str, Any]) -> None:
        if method == "Network.requestWillBeSent":
            self.asked.append(parameters["request"]["url"])
        elif method == "Network.webSocketCreated":
            self.asked.append(parameters["url"])
        elif method in {"Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"}:
            self.said.append(json.dumps(parameters))


@contextmanager
def browser(folder: Path) -> Iterator[Tab]:
    """Run a browser whose profile is in `folder`; give its tab."""
    assert BROWSER is not None
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0", "--no-first-run"]
    command = [BROWSER, *options, f"--user-data-dir={folder}", "about:blank"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            with urlopen(f"http://127.0.0.1:{_port(folder / 'DevToolsActivePort')}/json/list") as answer:
                (target,) = (each for each in json.load(answer) if each["type"] == "page")
            with connect(target["webSocketDebuggerUrl"], max_size=None) as socket:
                yield Tab(socket)
        finally:
            process.terminate()


def _port(file: Path) -> int:
    end = time.monotonic() + PATIENCE
    while not (file.exists() and file.read_text().count("\n")):
        assert time.monotonic() < end, "the browser must start"
        time.sleep(0.02)
    return int(file.read_text().splitlines()[0])
