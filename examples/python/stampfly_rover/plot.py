"""Live plots of the log without any library: in the terminal, or as a page served on the loopback interface."""

from __future__ import annotations

import json
import threading
from collections import deque
from dataclasses import asdict
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from typing import Deque, List, Optional, Sequence, TextIO, Tuple, Type
from urllib.parse import parse_qs, urlsplit

from .messages import LogRecord, SystemState

_BARS = " ▁▂▃▄▅▆▇█"


def sparkline(values: Sequence[float], low: float, high: float, width: int) -> str:
    """The newest ``width`` values as one line of bars between ``low`` and ``high``."""
    steps = len(_BARS) - 1

    def bar(value: float) -> str:
        share = (value - low) / (high - low) if high > low else 0.0
        return _BARS[max(0, min(steps, round(share * steps)))]

    return "".join(bar(value) for value in values[-width:]).rjust(width)


def track(points: Sequence[Tuple[float, float]], width: int, height: int) -> List[str]:
    """The path seen from above, x to the right and y up, with the newest point as ``@``. One scale for both axes."""
    rows = [[" "] * width for _ in range(height)]
    if points:
        (left, right), (bottom, top) = ((min(axis), max(axis)) for axis in zip(*points))
        # A character of a terminal is twice as high as it is wide.
        scale = max((right - left) / max(width - 1, 1), (top - bottom) / max(2 * (height - 1), 1), 1e-9)
        for index, (x, y) in enumerate(points):
            column = min(width - 1, round((x - left) / scale))
            row = min(height - 1, round((y - bottom) / (2 * scale)))
            rows[height - 1 - row][column] = "@" if index == len(points) - 1 else "·"
    return ["".join(row) for row in rows]


class TerminalPlot:
    """Draws the log into a terminal, a few times a second."""

    def __init__(self, out: TextIO, width: int = 64, height: int = 16, every: float = 0.2) -> None:
        self._out, self._width, self._height, self._every = out, width, height, every
        self._records: Deque[LogRecord] = deque(maxlen=2000)
        self._drawn: Optional[float] = None

    def add(self, record: LogRecord) -> None:
        """Adds a line of the log and draws when it is time, by the rover's clock."""
        self._records.append(record)
        if self._drawn is None or not 0.0 <= record.t - self._drawn < self._every:
            # Home and clear below: redraws in place, and scrolls nothing.
            self._out.write("\x1b[H\x1b[J" + "\n".join(self.lines()) + "\n")
            self._out.flush()
            self._drawn = record.t

    def lines(self) -> List[str]:
        """The picture as text."""
        records, newest = list(self._records), self._records[-1]
        lines = track([(record.x, record.y) for record in records], self._width, self._height)
        # As many lines of the log as bars, over the whole time shown.
        shown = records[:: max(1, len(records) // self._width)]
        for name, unit, low, high in (("v", "m/s", 0.0, 3.0), ("throttle", "", 0.0, 1.0), ("steer", "", -1.0, 1.0)):
            bars = sparkline([getattr(record, name) for record in shown], low, high, self._width - 24)
            lines.append(f"{name:>8} {getattr(newest, name):8.3f} {unit:<4} {bars}")
        state = SystemState(newest.system_state).name
        lines.append(f"t {newest.t:.2f} s  x {newest.x:.2f} m  y {newest.y:.2f} m  yaw {newest.yaw:.2f} rad  {state}")
        return lines


class PlotServer:
    """Serves a page that plots the log while it grows. Listens on the loopback interface only.

    The page has everything in it and asks for new lines ten times a second. Use it as a context manager; :attr:`url` is
    where to look.
    """

    def __init__(self, port: int = 0, limit: int = 20_000) -> None:
        self._records: Deque[LogRecord] = deque(maxlen=limit)
        self._count = 0
        self._lock = threading.Lock()
        page = Path(__file__).with_name("plot.html").read_bytes()
        plot = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:  # the name is the base class's
                url = urlsplit(self.path)
                if url.path == "/":
                    self._answer("text/html; charset=utf-8", page)
                elif url.path == "/log":
                    since = parse_qs(url.query).get("since", ["0"])[0]
                    self._answer("application/json", plot.lines(int(since) if since.isdecimal() else 0))
                else:
                    self.send_error(404)

            def _answer(self, kind: str, body: bytes) -> None:
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: object) -> None:
                """The terminal is for the rover, not for requests."""

        self._server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://127.0.0.1:{self._server.server_address[1]}/"

    def __enter__(self) -> PlotServer:
        self._thread.start()
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def add(self, record: LogRecord) -> None:
        """Adds a line of the log."""
        with self._lock:
            self._records.append(record)
            self._count += 1

    def lines(self, since: int) -> bytes:
        """JSON: the lines after the first ``since`` ones, and how many there are now."""
        with self._lock:
            count = self._count
            wanted = max(0, count - since) if since <= count else count
            records = list(self._records)[-wanted:] if wanted else []
        return json.dumps({"count": count, "records": [asdict(record) for record in records]}).encode()
