"""A real browser's page loses its server, or a vehicle, and finds it again: what it shows and what it sends meanwhile.

    link.py PROGRAM FOLDER

Between page and server is a relay that holds every byte up for a while, and then lets all of them
pass, as a network does that is gone for a moment. Exit code 0, or an exception that says what is
not as it should be.
"""

import re
import signal
import socket
import sys
import tempfile
import threading
import time
from pathlib import Path

from connect import Program, station, vehicle
from page import CHROMIUM, figure, text, until
from playwright.sync_api import Page, sync_playwright

# The page shows within two seconds that what it shows is old. A busy machine is later.
SOON = 2.0 + 1.0
# A commander who is not heard for this long has lost the vehicle to the next command.
LOST = 3.0


class Relay:
    """Passes bytes on to a port of this machine, both ways, unless it holds them."""

    def __init__(self, port: int) -> None:
        self.far = port
        self.holds = False
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self) -> None:
        while True:
            near = self.listener.accept()[0]
            try:
                far = socket.create_connection(("127.0.0.1", self.far))
            except OSError:
                near.close()
                continue
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self.carry, args=(source, sink), daemon=True).start()

    def carry(self, source: socket.socket, sink: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                while self.holds:
                    time.sleep(0.02)
                sink.sendall(data)
        except OSError:
            pass
        for end in (source, sink):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass


def is_dim(page: Page) -> bool:
    """Are figures, horizon, view and plots dimmed?"""
    return page.evaluate(
        """() => ['figures', 'horizon', 'space', 'strips'].every((id) =>
            Number(getComputedStyle(document.getElementById(id)).opacity) < 0.5)"""
    )


def shows_that_it_is_old(page: Page, of: str) -> None:
    begun = time.monotonic()
    until("old state is shown as old", lambda: page.is_visible("#old") and is_dim(page), SOON)
    assert of in text(page, "old"), text(page, "old")
    # Words change ten times a second.
    until("the phase is not said", lambda: text(page, "phase") == "not heard", SOON)
    assert text(page, "armed") == "" and text(page, "commander") == "" and not page.is_visible("#ready")
    for name in ("arm", "take-off", "hold", "disarm", "flip-left"):
        assert page.is_disabled(f"#{name}"), f"{name} can be pressed"
    for name in ("kill", "land"):
        assert page.is_enabled(f"#{name}"), f"{name} cannot be pressed"
    print(f"{of}: shown as old after {time.monotonic() - begun:.1f} s")


def shows_that_it_is_live(page: Page) -> None:
    until("live again", lambda: not page.is_visible("#old") and not is_dim(page) and text(page, "phase") != "not heard", 10)
    assert page.is_enabled("#arm")


def does_nothing_late(page: Page, relay: Relay, seconds: float) -> None:
    """What is asked while the network is gone is not done when it is back."""
    until("it may be armed", lambda: page.is_visible("#ready"), 60)
    before = text(page, "messages")
    relay.holds = True
    begun = time.monotonic()
    time.sleep(0.2)
    # On their way when the network goes.
    page.click("#arm")
    page.click("#take-off")
    shows_that_it_is_old(page, "server")
    # And past every button.
    page.evaluate("document.getElementById('arm').disabled = false; document.getElementById('arm').click()")
    until("it is not sent", lambda: "not sent" in text(page, "messages"))
    time.sleep(max(0.0, seconds - (time.monotonic() - begun)))
    relay.holds = False
    shows_that_it_is_live(page)
    until_end = time.monotonic() + 2.5
    while time.monotonic() < until_end:
        rose = abs(figure(page, "height")) > 0.05
        assert text(page, "armed") != "ARMED" and not rose, f"done {seconds} s later"
        time.sleep(0.05)
    said = text(page, "messages").removesuffix(before)
    assert ": arm\n" not in said and "arm: done" not in said, said


def rises(page: Page) -> None:
    until("it may be armed", lambda: page.is_visible("#ready"), 60)
    page.click("#arm")
    until("armed", lambda: text(page, "armed") == "ARMED")
    page.click("#take-off")
    until("in the air", lambda: text(page, "phase") == "flying" and figure(page, "height") > 0.3)


def lands(page: Page) -> None:
    page.click("#land")
    until("landed", lambda: text(page, "armed") == "disarmed")


def says_who_commands(pages: list[Page]) -> None:
    flies, watches = pages
    rises(flies)
    until("the page says that it flies", lambda: text(flies, "commander") == "flown by this page")
    until("another says which does", lambda: re.fullmatch(r"flown by page \d+", text(watches, "commander")))
    before = text(watches, "commander")
    watches.click("#hold")
    until("another's command is refused", lambda: re.search(r"hold: page \d+ commands", text(watches, "messages")))
    # A page that is loaded again is another one. It may command no later than when its predecessor is taken for lost.
    flies.reload()
    begun = time.monotonic()
    until("it is there again", lambda: text(flies, "phase") == "flying")

    def takes_over() -> bool:
        flies.click("#hold")
        time.sleep(0.2)
        return text(flies, "commander") == "flown by this page"

    until("it commands again", takes_over, 2 * LOST)
    took = time.monotonic() - begun
    assert took < LOST + 1, f"refused for {took:.1f} s"
    until("the other says so", lambda: text(watches, "commander") not in (before, ""))
    assert "hold" in text(watches, "messages"), "what is asked is told to everybody"
    print(f"a page that was loaded again commands after {took:.1f} s")
    lands(flies)


def is_let_down_without_its_commander(pages: list[Page]) -> None:
    flies, watches = pages
    rises(flies)
    flies.close()
    until("none commands", lambda: text(watches, "commander") == "none commands", 2)
    until("the link is lost", lambda: "command" in text(watches, "alerts"), LOST + 1)
    until("it has landed", lambda: text(watches, "armed") == "disarmed", 30)


def kills_behind_a_log(page: Page, folder: Path) -> None:
    """A log in front of a vehicle that flies does not keep its motors on."""
    page.click("#tab-log")
    with page.expect_download() as waiting:
        page.click("#download")
    file = folder / "so-far.ulg"
    waiting.value.save_as(file)
    rises(page)
    page.set_input_files("#log-file", file)
    until("the log is open", lambda: page.is_visible("#player"))
    assert page.is_disabled("#arm") and page.is_enabled("#kill")
    page.click("#kill")
    page.click("#live")
    until("motors off", lambda: text(page, "armed") == "disarmed", 3)


def serve(program: str, folder: Path, port: int = 0) -> tuple[Program, int]:
    serving = Program(program, "serve", "--out", str(folder), "--port", f"http={port}", "--port", "others=off")
    return serving, int(serving.said(r"http://[\w.:\[\]]+:(\d+)"))


def main(program: str, folder: Path) -> None:
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as downloads:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        serving, port = serve(program, folder / "link")
        relay = Relay(port)
        page = browser.new_page()
        try:
            page.goto(f"http://127.0.0.1:{relay.port}/")
            for seconds in (2.2, 6.0):
                does_nothing_late(page, relay, seconds)
            watches = browser.new_page()
            watches.goto(f"http://127.0.0.1:{port}/")
            says_who_commands([page, watches])
            kills_behind_a_log(watches, Path(downloads))
            serving.process.send_signal(signal.SIGSTOP)
            shows_that_it_is_old(watches, "server")
            serving.process.send_signal(signal.SIGCONT)
            shows_that_it_is_live(watches)
            serving.kill()
            shows_that_it_is_old(page, "server")
            serving, _ = serve(program, folder / "link", port)
            shows_that_it_is_live(page)
            until("both are there", lambda: watches.is_visible("#ready"), 60)
            is_let_down_without_its_commander([page, watches])
        except AssertionError:
            for shown in browser.contexts[0].pages:
                print(text(shown, "messages"))
            raise
        finally:
            serving.process.send_signal(signal.SIGCONT)
            serving.kill()
        # A vehicle that falls silent at the other end of a line.
        flying = vehicle(program, folder / "link", "usb-tcp=0")
        line = flying.said(r"^usb-tcp .*:(\d+)$")
        bridge = station(program, folder / "link-station", f"tcp:127.0.0.1:{line}")
        try:
            page = browser.new_page()
            page.goto(bridge.said(r"(http://[\w.:\[\]]+)") + "/")
            until("it may be armed", lambda: page.is_visible("#ready"), 60)
            flying.process.send_signal(signal.SIGSTOP)
            shows_that_it_is_old(page, "vehicle")
            flying.process.send_signal(signal.SIGCONT)
            shows_that_it_is_live(page)
        finally:
            flying.process.send_signal(signal.SIGCONT)
            flying.kill()
            bridge.kill()
        browser.close()
    print("what is old is shown as old, and nothing is done late")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2])))
