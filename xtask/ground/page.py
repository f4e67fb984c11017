"""The ground station's page in a real browser: looks at it, flies with it, opens the log of the flight.

    page.py [--look] [--pictures FOLDER] PROGRAM ARGUMENT...

PROGRAM prints the address of its page. With --look its vehicles take no commands. Chromium is Debian's; nothing is downloaded.
Exit code 0, or an exception that says what is not as it should be.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

CHROMIUM = "/usr/bin/chromium"
PATIENCE = 30.0


class Watched:
    """A page, with all that must not happen in it."""

    def __init__(self, page: Page, address: str) -> None:
        self.page = page
        self.wrong: list[str] = []
        page.on("console", self.said)
        page.on("pageerror", lambda error: self.wrong.append(f"exception: {error}"))
        page.on("request", lambda request: self.requested(request.url, address))
        page.on("websocket", lambda socket: self.requested(socket.url, address.replace("http", "ws", 1)))

    def said(self, message) -> None:
        if message.type in ("error", "warning"):
            self.wrong.append(f"console: {message.text}")

    def requested(self, url: str, address: str) -> None:
        if not url.startswith((address, "data:", "blob:")):
            self.wrong.append(f"request: {url}")

    def check(self) -> None:
        assert not self.wrong, "\n".join(self.wrong)


def until(what: str, condition, patience: float = PATIENCE) -> None:
    """Waits for a condition; every look is of the page as a person sees it."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.05)
    raise AssertionError(f"{what}: not within {patience} s")


def text(page: Page, name: str) -> str:
    return page.inner_text(f"#{name}")


def figure(page: Page, name: str) -> float:
    shown = text(page, f"figure-{name}").replace("−", "-")
    return float(shown) if re.fullmatch(r"-?[\d.]+", shown) else float("nan")


def colours(page: Page, canvas: str) -> int:
    """How many colours a canvas has: an empty one has one."""
    return page.evaluate(
        """(id) => {
            const canvas = document.getElementById(id);
            const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
            const found = new Set();
            for (let k = 0; k < data.length; k += 16) found.add((data[k] << 16) | (data[k + 1] << 8) | data[k + 2]);
            return found.size;
        }""",
        canvas,
    )


def looks_right(page: Page) -> None:
    until("state arrives", lambda: text(page, "phase") not in ("–", "no state yet"))
    until("fifty texts a second", lambda: (rate := re.match(r"(\d+) Hz", text(page, "link"))) and int(rate[1]) >= 40)
    assert "dropped" not in text(page, "link"), text(page, "link")
    assert colours(page, "space") > 20, "the view is empty"
    assert page.locator("#strips canvas").count() >= 3
    # Everything that takes something has a name, and no element is styled past the policy.
    nameless = page.evaluate(
        """() => [...document.querySelectorAll('button, input:not([hidden]), select')].filter((node) =>
            !(node.getAttribute('aria-label') || node.textContent.trim() || node.closest('label')?.textContent.trim())
        ).map((node) => node.outerHTML)"""
    )
    assert not nameless, nameless
    page.click("#chosen")
    reached = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id"))
    for name in ("space", "arm", "take-off", "land", "kill"):
        assert name in reached, f"{name} is not reached with the keyboard: {sorted(reached)}"


def keyboard_moves_tabs(page: Page) -> None:
    page.focus("#tab-fly")
    page.keyboard.press("ArrowRight")
    assert page.get_attribute("#tab-parameters", "aria-selected") == "true"
    assert page.is_visible("#panel-parameters") and not page.is_visible("#panel-fly")


def changes_a_parameter(page: Page) -> None:
    page.click("#tab-parameters")
    page.fill("#parameter-search", "eskf.gate")
    row = page.locator("#parameters tr[data-name='eskf.gate']:visible")
    until("one parameter is found", lambda: row.count() == 1)
    value = row.locator("input")
    before = float(value.input_value())
    value.fill("1e9")
    value.press("Enter")
    until("a value out of range is refused", lambda: " to " in row.locator(".note").inner_text())
    value.fill(str(before + 0.5))
    value.press("Enter")
    until("the value is taken", lambda: row.locator(".note").inner_text() == "✓")
    assert "changed" in row.get_attribute("class")
    row.get_by_role("button").click()
    until("and the default again", lambda: "changed" not in (row.get_attribute("class") or ""))
    assert float(value.input_value()) == before
    page.fill("#parameter-search", "")


def flies(page: Page, picture) -> None:
    until("it may be armed", lambda: page.is_visible("#ready"), 60)
    picture("ready")
    page.click("#arm")
    until("armed", lambda: text(page, "armed") == "ARMED")
    page.fill("#height", "0.6")
    page.click("#take-off")
    until("taken off", lambda: text(page, "phase") == "flying" and abs(figure(page, "height") - 0.6) < 0.1)
    box = page.locator("#space").bounding_box()
    page.mouse.click(box["x"] + box["width"] * 0.64, box["y"] + box["height"] * 0.62)
    until("a goal is set", lambda: (page.input_value("#goal-north"), page.input_value("#goal-east")) != ("0", "0"))
    north, east = (float(page.input_value(f"#goal-{name}")) for name in ("north", "east"))
    picture("on-its-way")
    until(f"it is at {north}, {east}",
          lambda: abs(figure(page, "north") - north) < 0.15 and abs(figure(page, "east") - east) < 0.15)
    picture("there")
    page.click("#land")
    until("landed", lambda: text(page, "phase") == "on the ground" and text(page, "armed") == "disarmed")


def injects_a_fault(page: Page, picture) -> None:
    page.click("#tab-faults")
    page.fill("#fault-search", "flow-lost" if page.locator("#faults li", has_text="flow-lost").count() else "flow")
    page.fill("#fault-seconds", "2")
    page.locator("#faults li:visible button").first.click()
    until("an alert is shown", lambda: page.is_visible("#alarm"))
    picture("fault")
    page.fill("#fault-search", "")
    until("and goes with the fault", lambda: not page.is_visible("#alarm"))


def kills(page: Page) -> None:
    until("it may be armed", lambda: page.is_visible("#ready"), 60)
    page.click("#arm")
    until("armed", lambda: text(page, "armed") == "ARMED")
    page.click("#take-off")
    until("in the air", lambda: figure(page, "height") > 0.2)
    page.keyboard.press("Escape")
    until("motors off", lambda: text(page, "armed") == "disarmed", 2)


def opens_the_log(page: Page, folder: Path, picture, least_height: float) -> None:
    page.click("#tab-log")
    with page.expect_download() as waiting:
        page.click("#download")
    file = folder / "downloaded.ulg"
    waiting.value.save_as(file)
    assert file.read_bytes().startswith(b"ULog\x01\x12\x35"), "no ULog file"
    page.set_input_files("#log-file", file)
    until("the log is open", lambda: page.is_visible("#player"))
    assert page.is_disabled("#arm"), "a recorded flight takes no commands"
    low, high = (float(page.get_attribute("#slider", side)) for side in ("min", "max"))
    assert high - low > 1, (low, high)
    heights = []
    for share in range(0, 101, 5):
        page.evaluate(
            """(time) => {
                const slider = document.getElementById('slider');
                slider.value = time;
                slider.dispatchEvent(new Event('input'));
            }""",
            low + (high - low) * share / 100,
        )
        page.wait_for_timeout(150)
        heights.append(figure(page, "height"))
        if share == 40:
            picture("log")
    assert max(heights) > least_height and min(heights) < 0.1, heights
    page.click("#live")
    until("live again", lambda: not page.is_visible("#player") and page.locator("#download").is_visible())
    # What is no log is refused with a sentence.
    nonsense = folder / "nonsense.ulg"
    nonsense.write_bytes(b"nonsense" * 100)
    page.set_input_files("#log-file", nonsense)
    until("refused", lambda: "no ULog file" in text(page, "messages"))


def address_of(program: subprocess.Popen) -> str:
    for line in program.stdout:
        if found := re.search(r"http://[\w.:\[\]]+", line):
            # Whatever it says later must not fill the pipe.
            threading.Thread(target=program.stdout.read, daemon=True).start()
            return found[0] + "/"
    raise AssertionError("the program ended without an address")


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--look", action="store_true")
    arguments.add_argument("--pictures", type=Path)
    arguments.add_argument("program", nargs=argparse.REMAINDER)
    options = arguments.parse_args()
    program = subprocess.Popen(options.program, stdout=subprocess.PIPE, text=True)
    try:
        with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            look(browser, address_of(program), options, Path(folder))
            browser.close()
    finally:
        program.kill()
        program.wait()


def look(browser, address: str, options, folder: Path) -> None:
    watched = Watched(browser.new_page(viewport={"width": 1440, "height": 900}, color_scheme="light"), address)
    page = watched.page

    def picture(name: str) -> None:
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=options.pictures / f"{name}.png")

    page.goto(address)
    looks_right(page)
    keyboard_moves_tabs(page)
    changes_a_parameter(page)
    picture("parameters")
    if options.look:
        until("a flight is over", lambda: "is over" in text(page, "messages"), 90)
    else:
        page.click("#tab-fly")
        flies(page, picture)
        injects_a_fault(page, picture)
        kills(page)
    opens_the_log(page, folder, picture, 0.3)
    for tab in ("faults", "calibrate", "motors", "console"):
        page.click(f"#tab-{tab}")
        picture(tab)
    for name, size, scheme in (("dark", (1440, 900), "dark"), ("narrow", (420, 900), "light")):
        page.set_viewport_size({"width": size[0], "height": size[1]})
        page.emulate_media(color_scheme=scheme)
        page.wait_for_timeout(500)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), f"{name}: wider than the window"
        picture(name)
    watched.check()
    print(f"the page of {address} is as it should be")


if __name__ == "__main__":
    sys.exit(main())
