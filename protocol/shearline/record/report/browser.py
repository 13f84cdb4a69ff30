"""A real browser without a window, to look at a report: Chromium, spoken to through two pipes.

Speaks the DevTools protocol (https://chromedevtools.github.io/devtools-protocol/), one JSON
object after another, each ended by a zero byte, on the child's descriptors 3 and 4: no port is
opened. Knows nothing of what a page shows.
"""

from __future__ import annotations

import base64
import fcntl
import json
import os
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from shearline.protocol.errors import RecordError

#: What Chromium is called, here and there.
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
#: A busy machine may take this long for one answer [s].
PATIENCE_S = 60.0
#: Asked to close, it has this long before it is killed [s].
CLOSE_S = 5.0
#: Descriptors from here on are in nobody's way.
FREE_FD = 10

_FLAGS = (
    "--headless",
    "--remote-debugging-pipe",
    "--disable-gpu",
    "--hide-scrollbars",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-dev-shm-usage",
    "--disable-extensions",
    "--disable-sync",
)


def executable() -> str | None:
    """Return where Chromium is, or ``None`` where there is none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """A running browser."""

    def __init__(self, write_fd: int, read_fd: int) -> None:
        self._write_fd, self._read_fd = write_fd, read_fd
        self._asked = 0
        self._left = b""
        self._pages: dict[str, Page] = {}
        self._targets: list[str] = []

    def open(
        self,
        path: Path,
        *,
        width_px: int = 1280,
        height_px: int = 900,
        dark: bool = False,
        script: bool = True,
    ) -> Page:
        """Load a file and return its page once everything in it is there.

        Args:
            path: An HTML file.
            width_px: Of the viewport, in CSS pixels; below 600 it is taken for a phone.
            height_px: Likewise.
            dark: Whether the reader prefers dark pages.
            script: Whether scripts may run.

        Raises:
            RecordError: If the browser does not answer.
        """
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._targets.append(target)
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = self._pages[session] = Page(self, session)
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.ask(f"{domain}.enable")
        metrics = {"width": width_px, "height": height_px, "deviceScaleFactor": 1}
        page.ask("Emulation.setDeviceMetricsOverride", **metrics, mobile=width_px < 600)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        page.ask("Emulation.setEmulatedMedia", features=[scheme])
        page.ask("Emulation.setScriptExecutionDisabled", value=not script)
        page.ask("Page.navigate", url=path.resolve().as_uri())
        until_s = time.monotonic() + PATIENCE_S
        while not page.loaded:
            self._hear(until_s)
        return page

    def close_pages(self) -> None:
        """Close every page; the browser stays."""
        for target in self._targets:
            self.ask("Target.closeTarget", targetId=target)
        self._targets.clear()
        self._pages.clear()

    def ask(self, method: str, session: str | None = None, **parameters: Any) -> dict[str, Any]:
        """Ask for one thing and return the answer.

        Raises:
            RecordError: If the browser refuses or does not answer.
        """
        self._asked += 1
        message = {"id": self._asked, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self._write_fd, json.dumps(message).encode() + b"\0")
        until_s = time.monotonic() + PATIENCE_S
        while (heard := self._hear(until_s)).get("id") != self._asked:
            pass
        if "error" in heard:
            raise RecordError(f"the browser refused {method}: {heard['error'].get('message')}")
        result: dict[str, Any] = heard["result"]
        return result

    def _hear(self, until_s: float) -> dict[str, Any]:
        """Return the next message; events are also noted by their page."""
        while b"\0" not in self._left:
            wait_s = max(until_s - time.monotonic(), 0.0)
            ready, _, _ = select.select([self._read_fd], [], [], wait_s)
            read = os.read(self._read_fd, 1 << 20) if ready else b""
            if not read:
                raise RecordError("the browser does not answer: try it by hand")
            self._left += read
        text, _, self._left = self._left.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        if page := self._pages.get(message.get("sessionId", "")):
            page.note(message)
        return message


class Page:
    """One loaded page.

    Attributes:
        loaded: Whether it is complete.
        errors: What its script, or the browser about it, complained of.
        requests: Everything it asked for, itself first.
    """

    def __init__(self, browser: Browser, session: str) -> None:
        self._browser, self._session = browser, session
        self.loaded = False
        self.errors: list[str] = []
        self.requests: list[str] = []

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Ask the browser for one thing about this page."""
        return self._browser.ask(method, self._session, **parameters)

    def note(self, message: dict[str, Any]) -> None:
        """Take in one event."""
        said = message.get("params", {})
        match message.get("method"):
            case "Page.loadEventFired":
                self.loaded = True
            case "Runtime.exceptionThrown":
                self.errors.append(json.dumps(said["exceptionDetails"]))
            case "Log.entryAdded" if said["entry"]["level"] in ("error", "warning"):
                self.errors.append(str(said["entry"]["text"]))
            case "Network.requestWillBeSent":
                self.requests.append(str(said["request"]["url"]))

    def evaluate(self, script: str) -> Any:
        """Return the value of an expression of JavaScript in the page."""
        result = self.ask("Runtime.evaluate", expression=script, returnByValue=True)["result"]
        return result.get("value")

    def screenshot(self, *, full: bool = False) -> bytes:
        """Return a PNG of what is in view, or of the whole page."""
        shot = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=full)
        return base64.b64decode(shot["data"])

    def pdf(self) -> bytes:
        """Return the page as it is printed."""
        printed = self.ask("Page.printToPDF", printBackground=True, preferCSSPageSize=True)
        return base64.b64decode(printed["data"])


@contextmanager
def browser() -> Iterator[Browser]:
    """Run a browser for as long as the block lasts.

    Raises:
        RecordError: If there is none on this machine.
    """
    path = executable()
    if path is None:
        raise RecordError(f"expected one of {', '.join(NAMES)} on the path: install chromium")
    to_child, write_fd = _pipe()
    read_fd, from_child = _pipe()
    with tempfile.TemporaryDirectory(
        prefix="shearline-browser-", ignore_cleanup_errors=True
    ) as home:
        pid = _spawn(path, home, to_child, from_child)
        os.close(to_child)
        os.close(from_child)
        running = Browser(write_fd, read_fd)
        try:
            yield running
        finally:
            with suppress(RecordError, OSError):
                running.ask("Browser.close")
            _end(pid)
            os.close(write_fd)
            os.close(read_fd)


def _spawn(path: str, home: str, to_child: int, from_child: int) -> int:
    null = os.open(os.devnull, os.O_RDWR)
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []  # it has none for root
    try:
        return os.posix_spawn(
            path,
            [path, *_FLAGS, *sandbox, f"--user-data-dir={home}", "about:blank"],
            os.environ,
            file_actions=[
                (os.POSIX_SPAWN_DUP2, null, 0),
                (os.POSIX_SPAWN_DUP2, null, 1),
                (os.POSIX_SPAWN_DUP2, null, 2),
                (os.POSIX_SPAWN_DUP2, to_child, 3),
                (os.POSIX_SPAWN_DUP2, from_child, 4),
            ],
            setpgroup=0,
        )
    finally:
        os.close(null)


def _pipe() -> tuple[int, int]:
    """Return a pipe whose ends are far from the descriptors that the child is given."""
    ends = os.pipe()
    moved = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, FREE_FD) for end in ends]
    for end in ends:
        os.close(end)
    return moved[0], moved[1]


def _end(pid: int) -> None:
    """See the browser out, and kill it with its children if it stays."""
    until_s = time.monotonic() + CLOSE_S
    while os.waitpid(pid, os.WNOHANG) == (0, 0):
        if time.monotonic() > until_s:
            with suppress(ProcessLookupError):
                os.killpg(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return
        time.sleep(0.02)
