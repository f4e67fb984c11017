"""The terminal's picture, and the page with what it asks for."""

from __future__ import annotations

import io
import json
import re
import shutil
import subprocess
import unittest
import urllib.error
import urllib.request
from pathlib import Path

import stampfly_rover
from stampfly_rover import LogRecord, SystemState
from stampfly_rover.plot import PlotServer, TerminalPlot, sparkline, track

PAGE = (Path(stampfly_rover.__file__).parent / "plot.html").read_text(encoding="utf-8")


class Terminal(unittest.TestCase):
    def test_a_sparkline_shows_the_newest_values(self) -> None:
        self.assertEqual(sparkline([0.0, 0.5, 1.0], 0.0, 1.0, 3), " ▄█")
        self.assertEqual(sparkline([9.0, -9.0, 1.0], 0.0, 1.0, 2), " █")
        self.assertEqual(sparkline([1.0], 0.0, 1.0, 3), "  █")
        self.assertEqual(sparkline([1.0], 1.0, 1.0, 1), " ")

    def test_a_track_has_one_scale_and_the_vehicle_at_its_end(self) -> None:
        self.assertEqual(track([(0.0, 0.0), (2.0, 0.0), (2.0, 4.0)], 5, 3), ["  @  ", "     ", "· ·  "])
        self.assertEqual(track([(5.0, 5.0)], 3, 2), ["   ", "@  "])
        self.assertEqual(track([], 2, 2), ["  ", "  "])

    def test_the_picture_has_the_values_and_the_state(self) -> None:
        out = io.StringIO()
        plot = TerminalPlot(out, every=0.1)
        for tick in range(100):
            plot.add(LogRecord(t=tick * 0.01, v=tick * 0.02, x=tick * 0.1, system_state=SystemState.Degraded))
        self.assertEqual(out.getvalue().count("\x1b[H"), 10)
        text = "\n".join(plot.lines())
        for part in ("v    1.980 m/s", "x 9.90 m", "Degraded", "@"):
            self.assertIn(part, text)
        self.assertTrue(all(len(line) <= 80 for line in plot.lines()))


class Page(unittest.TestCase):
    def get(self, url: str) -> bytes:
        with urllib.request.urlopen(url, timeout=5.0) as answer:
            self.assertEqual(answer.status, 200)
            return bytes(answer.read())

    def test_the_page_and_the_log_are_served_on_the_loopback_interface(self) -> None:
        with PlotServer(limit=50) as server:
            self.assertTrue(server.url.startswith("http://127.0.0.1:"))
            self.assertEqual(self.get(server.url).decode(), PAGE)
            for tick in range(60):
                server.add(LogRecord(t=tick * 0.01, system_state=SystemState.EStop))
            first = json.loads(self.get(server.url + "log?since=0"))
            self.assertEqual((first["count"], len(first["records"])), (60, 50), "as many as are kept")
            self.assertEqual(first["records"][-1]["system_state"], 2)
            self.assertEqual(json.loads(self.get(server.url + "log?since=58"))["records"][0]["t"], 0.58)
            self.assertEqual(json.loads(self.get(server.url + "log?since=60"))["records"], [])
            self.assertEqual(len(json.loads(self.get(server.url + "log?since=99"))["records"]), 50, "another log")
            self.assertEqual(len(json.loads(self.get(server.url + "log?since=x"))["records"]), 50)
            with self.assertRaises(urllib.error.HTTPError):
                self.get(server.url + "elsewhere")
            url = server.url
        with self.assertRaises(urllib.error.URLError):
            self.get(url)

    def test_the_page_needs_nothing_else(self) -> None:
        self.assertIsNone(re.search(r"https?://|src=|@import|href=", PAGE))
        fields = {name for name, _ in LogRecord.FIELDS}
        used = set(re.findall(r"\br\.([a-z_]+)", PAGE)) | set(re.findall(r'\["([a-z_]+)",', PAGE))
        self.assertTrue(used and used <= fields, used - fields)

    @unittest.skipUnless(shutil.which("node"), "needs node")
    def test_the_script_parses(self) -> None:
        script = PAGE.split("<script>")[1].split("</script>")[0]
        result = subprocess.run(["node", "--check", "-"], input=script, capture_output=True, text=True, timeout=30)
        self.assertEqual(result.returncode, 0, result.stderr)
