"""A real browser opens the page of `stampfly connect`, whose vehicle is at the other end of a serial line, and flies it.

    connect.py PROGRAM FOLDER

The vehicle is simulated by `stampfly serve`; its USB port is a pseudo-terminal, and once more a TCP port. Between the two programs nothing but bytes is
exchanged. Exit code 0, or an exception that says what is not as it should be.
"""

import re
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from page import CHROMIUM, Watched, asks_the_console, changes_a_parameter, figure, text, turns_a_motor, until
from playwright.sync_api import Page, sync_playwright


class Program:
    """A program that says where it is."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)

    def said(self, pattern: str) -> str:
        for line in self.process.stdout:
            if found := re.search(pattern, line):
                # Whatever it says later must not fill the pipe.
                threading.Thread(target=self.process.stdout.read, daemon=True).start()
                return found[1]
        raise AssertionError(f"the program ended without {pattern}")

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()


def vehicle(program: str, folder: Path, usb: str) -> Program:
    return Program(program, "serve", "--out", str(folder), "--port", "others=off", "--port", usb)


def station(program: str, folder: Path, place: str) -> Program:
    return Program(program, "connect", place, "--out", str(folder), "--port", "http=0", "--port", "mavlink-udp=off", "--port", "mavlink-tcp=0")


def shows_what_is_there(page: Page) -> None:
    until("state arrives", lambda: text(page, "phase") not in ("–", "no state yet", "not heard"))
    assert "heard at" in text(page, "messages"), text(page, "messages")
    assert not page.is_visible("#tab-faults") and not page.is_visible("#speed"), "no real vehicle has these"
    page.focus("#tab-parameters")
    page.keyboard.press("ArrowRight")
    assert page.get_attribute("#tab-calibrate", "aria-selected") == "true", "arrow keys pass over what is hidden"


def flies(page: Page) -> None:
    until("it may be armed", lambda: page.is_visible("#ready"), 60)
    page.click("#arm")
    until("armed", lambda: text(page, "armed") == "ARMED")
    page.fill("#height", "0.6")
    page.click("#take-off")
    until("taken off", lambda: text(page, "phase") == "flying" and abs(figure(page, "height") - 0.6) < 0.1)
    box = page.locator("#space").bounding_box()
    page.mouse.click(box["x"] + box["width"] * 0.64, box["y"] + box["height"] * 0.62)
    until("a goal is set", lambda: (page.input_value("#goal-north"), page.input_value("#goal-east")) != ("0", "0"))
    north, east = (float(page.input_value(f"#goal-{name}")) for name in ("north", "east"))
    until(f"it is at {north}, {east}",
          lambda: abs(figure(page, "north") - north) < 0.15 and abs(figure(page, "east") - east) < 0.15)
    page.click("#land")
    until("landed", lambda: text(page, "phase") == "on the ground" and text(page, "armed") == "disarmed")


def flies_by_hand(page: Page) -> None:
    page.click("#tab-fly")
    page.click("#by-keyboard")
    until("it may be armed", lambda: page.is_visible("#ready"), 60)
    page.keyboard.press("e")
    until("armed by hand", lambda: text(page, "armed") == "ARMED")
    page.keyboard.down("w")
    until("climbed by hand", lambda: figure(page, "height") > 0.3)
    page.keyboard.up("w")
    page.keyboard.press("Escape")
    until("motors off", lambda: text(page, "armed") == "disarmed", 2)


def has_a_log(page: Page, folder: Path) -> None:
    page.click("#tab-log")
    with page.expect_download() as waiting:
        page.click("#download")
    file = folder / "downloaded.ulg"
    waiting.value.save_as(file)
    page.set_input_files("#log-file", file)
    until("the log is open", lambda: page.is_visible("#player"))
    page.click("#live")
    until("live again", lambda: not page.is_visible("#player"))


def main(program: str, folder: Path) -> None:
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as downloads:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        serial = vehicle(program, folder / "serial", "usb=0")
        bridge = station(program, folder / "station", serial.said(r"^usb .* is (\S+)"))
        try:
            address = bridge.said(r"(http://[\w.:\[\]]+)") + "/"
            watched = Watched(browser.new_page(viewport={"width": 1440, "height": 900}), address)
            page = watched.page
            page.goto(address)
            shows_what_is_there(page)
            changes_a_parameter(page)
            page.click("#tab-fly")
            flies(page)
            has_a_log(page, Path(downloads))
            asks_the_console(page)
            until("it may be armed", lambda: page.is_visible("#ready"), 60)
            turns_a_motor(page, lambda _: None)
            flies_by_hand(page)
            # The cable is pulled out.
            serial.kill()
            until("it is said that the line is gone", lambda: text(page, "phase") == "not heard", 10)
            assert "the line at" in text(page, "messages"), text(page, "messages")
            watched.check()
        except AssertionError:
            print(text(page, "messages"))
            raise
        finally:
            serial.kill()
            bridge.kill()
        # And in again: at a place that stays the same.
        first = vehicle(program, folder / "tcp", "usb-tcp=0")
        port = first.said(r"^usb-tcp .*:(\d+)$")
        bridge = station(program, folder / "station", f"tcp:127.0.0.1:{port}")
        try:
            page = browser.new_page()
            page.goto(bridge.said(r"(http://[\w.:\[\]]+)") + "/")
            until("state arrives", lambda: text(page, "phase") not in ("–", "no state yet", "not heard"))
            first.kill()
            until("it is gone", lambda: text(page, "phase") == "not heard", 10)
            until("nothing can be asked", lambda: page.is_disabled("#arm"))
            page.click("#land")
            until("what is asked is refused", lambda: "the line to the vehicle is gone" in text(page, "messages"))
            first = vehicle(program, folder / "tcp", f"usb-tcp={port}")
            first.said(r"^usb-tcp .*:(\d+)$")
            until("it is there again", lambda: text(page, "phase") not in ("not heard", "no state yet"), 20)
            assert float(text(page, "clock").split()[0]) < 30, "its clock began anew"
        finally:
            first.kill()
            bridge.kill()
        browser.close()
    print("a vehicle at the other end of a line is flown as one in the same program")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2])))
