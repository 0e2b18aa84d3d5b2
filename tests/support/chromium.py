"""Drives a headless Chromium by its debugging pipe: opens pages, asks them, presses keys, and keeps what they did.

JSON messages with a zero byte behind each go through two pipes (`--remote-debugging-pipe`): nothing listens on a port, and
nothing but the standard library is needed.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Self

if TYPE_CHECKING:
    from pathlib import Path

START: Final = """
for name in chromium chromium-browser google-chrome; do
    command -v "$name" >/dev/null && exec "$name" "$@" 3<&{} 4>&{}
done
exit 127
"""
"""Starts the first of the browser's names that there is, with its pipes at 3 and 4, where it expects them."""
PATIENCE: Final = 60.0
"""An answer that takes longer, in s, does not come."""
OPTIONS: Final = (
    "--headless=new", "--remote-debugging-pipe", "--disable-gpu", "--no-first-run", "--disable-extensions", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-default-apps", "--mute-audio",
    "--no-proxy-server", "--hide-scrollbars", "--disable-dev-shm-usage", "--password-store=basic",
)  # fmt: skip
LOOK: Final = """(there) => new Promise((done, fail) => {
  const end = performance.now() + 20000;
  const look = () => {
    let found = false;
    try { found = there(); } catch { found = false; }
    if (found) done();
    else if (performance.now() > end) fail(new Error("it does not come true"));
    else setTimeout(look, 10);
  };
  look();
})"""
READING: Final = "willReadFrequently"
"""Of the advice that a browser gives where the picture is read: a test does."""
KEYS: Final = {" ": (32, "Space"), "ArrowLeft": (37, "ArrowLeft"), "ArrowRight": (39, "ArrowRight"), "Home": (36, "Home")}


class BrowserError(Exception):
    """The browser did not do what it was asked for; the text says what."""


@dataclass
class Seen:
    """What a page did.

    Attributes:
        requests: Addresses that it asked for, its own not counted.
        console: Errors and warnings on its console, exceptions among them.
        dialogs: Texts of dialogs that it opened.
    """

    requests: list[str] = field(default_factory=list)
    console: list[str] = field(default_factory=list)
    dialogs: list[str] = field(default_factory=list)

    @property
    def quiet(self) -> bool:
        """It did none of these."""
        return not (self.requests or self.console or self.dialogs)


class Chromium:
    """A browser; use as a context manager."""

    def __init__(self) -> None:
        self._profile = tempfile.mkdtemp(prefix="chromium-")
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()
        options = [*OPTIONS, f"--user-data-dir={self._profile}"]
        options += ["--no-sandbox"] if os.geteuid() == 0 else []
        self._process = subprocess.Popen(  # noqa: S603 - the browser of this machine
            ["/bin/bash", "-c", START.format(theirs_in, theirs_out), "bash", *options, "about:blank"],
            pass_fds=(theirs_in, theirs_out),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self._in, self._out = ours_in, ours_out
        self._rest = b""
        self._number = 0
        self.pages: dict[str, Page] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(BrowserError, OSError):
            self.call("Browser.close")
        os.close(self._out)
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._in)
        shutil.rmtree(self._profile, ignore_errors=True)

    def call(self, method: str, session: str = "", **params: object) -> dict[str, Any]:
        """Ask for something, and take in what happens until the answer is there.

        Args:
            method: As the DevTools protocol calls it.
            session: Of the page; empty: of the browser.
            **params: What it takes.

        Raises:
            BrowserError: It was refused, or no answer came.
        """
        self._number += 1
        number = self._number
        message: dict[str, Any] = {"id": number, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        try:
            os.write(self._out, json.dumps(message).encode() + b"\0")
        except BrokenPipeError as error:
            raise BrowserError("the browser is gone") from error
        deadline = time.monotonic() + PATIENCE
        while True:
            said = self._next(deadline, method)
            if said.get("id") == number:
                if "error" in said:
                    raise BrowserError(f"{method}: {said['error']}")
                result: dict[str, Any] = said["result"]
                return result
            self._happened(said)

    def _next(self, deadline: float, method: str) -> dict[str, Any]:
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._in], [], [], max(0.0, deadline - time.monotonic()))
            data = os.read(self._in, 1 << 20) if ready else b""
            if not data:
                raise BrowserError(f"no answer to {method}")
            self._rest += data
        text, _, self._rest = self._rest.partition(b"\0")
        said: dict[str, Any] = json.loads(text)
        return said

    def _happened(self, said: dict[str, Any]) -> None:
        page = self.pages.get(said.get("sessionId", ""))
        if page is not None:
            page.happened(said["method"], said["params"])

    def page(
        self, *, width: int = 1280, height: int = 800, dark: bool = False, still: bool = False, scale: float = 1.0
    ) -> Page:
        """A new page.

        Args:
            width: Of its window, in CSS pixels.
            height: Likewise.
            dark: It prefers dark colours.
            still: It prefers reduced motion.
            scale: Device pixels of a CSS pixel.
        """
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = self.pages[session] = Page(self, session, target)
        for domain in ("Page", "Runtime", "Network", "Log"):
            page.call(f"{domain}.enable")
        page.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=width < 600)
        features = [
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
            {"name": "prefers-reduced-motion", "value": "reduce" if still else "no-preference"},
        ]
        page.call("Emulation.setEmulatedMedia", features=features)
        return page


class Page:
    """A page of a browser.

    Args:
        browser: The browser.
        session: What it calls the page.
        target: Likewise.

    Attributes:
        seen: What it did.
    """

    def __init__(self, browser: Chromium, session: str, target: str) -> None:
        self._browser = browser
        self._session = session
        self._target = target
        self._url = ""
        self.seen = Seen()

    def call(self, method: str, **params: object) -> dict[str, Any]:
        """See `Chromium.call`."""
        return self._browser.call(method, self._session, **params)

    def close(self) -> None:
        """Close it."""
        self._browser.call("Target.closeTarget", targetId=self._target)
        self._browser.pages.pop(self._session, None)

    def happened(self, method: str, params: dict[str, Any]) -> None:
        """Keep what the browser tells of it."""
        if method == "Network.requestWillBeSent":
            url = params["request"]["url"]
            if url != self._url:
                self.seen.requests.append(url)
        elif method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.seen.console.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in {"error", "warning", "assert"}:
            self.seen.console.append(str(params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in {"error", "warning"} and READING not in str(params):
            self.seen.console.append(params["entry"]["text"])
        elif method == "Page.javascriptDialogOpening":
            self.seen.dialogs.append(params["message"])

    def open(self, path: Path, ready: str = "") -> None:
        """Open a file, and wait until it is there.

        Args:
            path: The file.
            ready: What is true of the page then, in JavaScript; empty: it is loaded.
        """
        self.visit(path.resolve().as_uri(), ready)

    def visit(self, url: str, ready: str = "") -> None:
        """Open a page by its address; see `open`."""
        self._url = url
        self.call("Page.navigate", url=url)
        self.wait(ready or "document.readyState === 'complete'")

    def ask(self, expression: str) -> Any:  # noqa: ANN401 - whatever the page says
        """What an expression comes to, or the promise that it is.

        Args:
            expression: In JavaScript.

        Raises:
            BrowserError: It threw.
        """
        said = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in said:
            details = said["exceptionDetails"]
            raise BrowserError(f"{expression}: {details.get('exception', {}).get('description', details['text'])}")
        return said["result"].get("value")

    def wait(self, condition: str) -> None:
        """Wait until something is true of the page, looked at every so often.

        Args:
            condition: In JavaScript.
        """
        self.ask(f"({LOOK})(() => {condition})")

    def press(self, key: str, *, shift: bool = False) -> None:
        """Press a key.

        Args:
            key: As the DOM calls it.
            shift: Together with the shift key.
        """
        code, name = KEYS.get(key, (ord(key[0].upper()), key))
        common = {"key": key, "code": name, "windowsVirtualKeyCode": code, "modifiers": 8 if shift else 0}
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", **common, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", **common)

    def click(self, x: float, y: float) -> None:
        """Click a place, in CSS pixels of the window."""
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def picture(self, path: Path, *, whole: bool = False) -> None:
        """Take a picture of it.

        Args:
            path: Where the PNG goes.
            whole: Of all of it, not of what is in the window.
        """
        data = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)["data"]
        path.write_bytes(base64.b64decode(data))
