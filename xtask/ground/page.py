"""The ground station's page in a real browser: looks at it, flies with it, opens the log of the flight.

    page.py [--pictures FOLDER] PROGRAM ARGUMENT...

PROGRAM flies two vehicles and prints the address of its page. Chromium is Debian's; nothing is downloaded.
Exit code 0, or an exception that says what is not as it should be.
"""

import argparse
import base64
import re
import struct
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


def plays_a_stick_file(page: Page, folder: Path) -> None:
    page.click("#tab-fly")
    until("it may be armed", lambda: page.is_visible("#ready"), 60)
    file = folder / "sticks.csv"
    file.write_text("t,throttle\n0,0\n")
    page.set_input_files("#sticks-file", file)
    until("no stick file is refused", lambda: "line 1: column roll is missing" in text(page, "messages"))
    # A climb, and the vehicle is let go in the air.
    rows = ("0,0,0,0,0,althold,0", "0.5,0,0,0,0,althold,1", "3.5,0.5,0,0,0,althold,1", "5,0,0,0,0,althold,1")
    file.write_text("\n".join(("t,throttle,roll,pitch,yaw,mode,arm", *rows)) + "\n")
    page.set_input_files("#sticks-file", file)
    until("the file is open", lambda: "5.0 s" in text(page, "sticks-state"))
    page.click("#sticks-play")
    until("its sticks fly", lambda: text(page, "phase") == "flying" and figure(page, "height") > 0.5)
    until("landed", lambda: text(page, "phase") == "on the ground" and text(page, "armed") == "disarmed")
    page.click("#sticks-play")
    until("in the air again", lambda: text(page, "phase") == "flying", 60)
    page.click("#sticks-stop")
    until("let go", lambda: "let go" in text(page, "sticks-state"))
    until("landed again", lambda: text(page, "phase") == "on the ground" and text(page, "armed") == "disarmed")


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


def opens_the_log(page: Page, program: str, folder: Path, picture) -> None:
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
    assert max(heights) > 0.3 and min(heights) < 0.1, heights
    page.click("#live")
    until("live again", lambda: not page.is_visible("#player") and page.locator("#download").is_visible())
    # What is no log is refused with a sentence, also when it is dropped; one that was cut off by a crash is shown.
    drop(page, b"nonsense" * 100)
    until("refused", lambda: "no ULog file" in text(page, "messages"))
    whole = file.read_bytes()
    middle = len(whole) // 2
    # Two bytes are no message, wherever they stand.
    for part in (whole[:middle] + bytes(2), whole[:middle] + whole[middle + 3 :]):
        drop(page, part)
        until("half a log is open", lambda: page.is_visible("#player"))
        file.write_bytes(part)
        said = subprocess.run([program, "log", "info", file], capture_output=True, text=True, check=True).stdout
        end = next(line for line in said.splitlines() if line.startswith("the log is "))
        until(f"the page says as the program: {end}", lambda end=end: end in text(page, "messages"))
        page.click("#vehicles button")
        until("live again", lambda: not page.is_visible("#player"))
    for claims in ("float[4000000000] x", "none[4000000000] x", "flight_status x"):
        told = text(page, "messages").count("flight_status left out")
        drop(page, hostile(claims))
        is_told = lambda told=told: text(page, "messages").count("flight_status left out") > told
        until(f"a log that claims {claims} is left out", is_told, 2)


def hostile(claims: str) -> bytes:
    """A small log with a topic of the page's whose fields are these."""

    def message(kind: str, payload: bytes) -> bytes:
        return struct.pack("<HB", len(payload), ord(kind)) + payload

    formats = f"flight_status:uint64_t timestamp;{claims};", "none:"
    log = b"ULog\x01\x12\x35\x01" + bytes(8) + message("B", bytes(40))
    log += b"".join(message("F", text.encode()) for text in formats)
    log += message("A", bytes(3) + b"flight_status")
    return log + b"".join(message("D", struct.pack("<HQf", 0, 1000 * at, 1.5)) for at in range(1, 4))


def drop(page: Page, contents: bytes) -> None:
    """Drops a file on the page, as a file manager would."""
    page.evaluate(
        """(encoded) => {
            const bytes = Uint8Array.from(atob(encoded), (letter) => letter.charCodeAt(0));
            const dataTransfer = new DataTransfer();
            dataTransfer.items.add(new File([bytes], 'dropped.ulg'));
            document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
        }""",
        base64.b64encode(contents).decode(),
    )


def shows_every_topic(page: Page, picture) -> None:
    page.click("#tab-log")
    row = page.locator("#rates tr", has=page.locator("button", has_text="sensor_imu"))
    until("a topic that no plot needs is counted", lambda: re.match(r"\d{3} Hz", row.locator("td").first.inner_text()))
    page.get_by_role("button", name="flight_status").click()
    until("and one is spelt out", lambda: "IdleGround" in page.inner_text("#rates"))
    picture("topics")


def asks_the_console(page: Page) -> None:
    page.click("#tab-console")
    page.fill("#console-line", "status")
    page.keyboard.press("Enter")
    until("the console answers", lambda: "disarmed" in text(page, "console-output"))
    page.keyboard.press("ArrowUp")
    assert page.input_value("#console-line") == "status", "the line before"
    page.fill("#console-line", "")


def calibrates(page: Page, picture) -> None:
    """The six positions, by the pictures, which turn a simulated vehicle; then the level, and what was found is taken."""
    page.click("#tab-calibrate")
    six = page.locator("#calibrations section[data-kind=six_positions]")
    said, take = six.locator(".said"), six.get_by_role("button", name="Take and keep")
    assert six.locator("svg.picture").count() == 6 and page.locator("#calibrations svg.picture").count() == 9
    six.get_by_role("button", name="Begin").click()
    until("it says what to do", lambda: "still to lie on its nose" in said.inner_text())
    for place, name in enumerate(("nose down", "nose up", "left side up", "right side up", "upright", "upside down")):
        assert not take.is_visible()
        six.get_by_role("button", name=name).first.click()
        until(f"{name} is done", lambda place=place: "done" in six.locator(".step").nth(place).get_attribute("class"))
        if place == 3:
            picture("six-positions")
    until("the seventh checks", lambda: "once more on any side" in said.inner_text())
    six.get_by_role("button", name="upright").click()
    until("there is a result", lambda: take.is_visible() and "scale" in said.inner_text())
    take.click()
    until("it is taken and saved", lambda: "saved, for the next start" in text(page, "messages"))
    level = page.locator("#calibrations section[data-kind=level]")
    level.get_by_role("button", name="Standing level").click()
    level.get_by_role("button", name="Begin").click()
    until("the level is found", lambda: level.get_by_role("button", name="Take and keep").is_visible())
    picture("level")
    level.get_by_role("button", name="Take and keep").click()
    until("and saved", lambda: text(page, "messages").count("saved, for the next start") == 2)
    page.click("#tab-parameters")
    page.fill("#parameter-search", "calibration.accel.bias_z")
    bias = page.locator("#parameters tr[data-name='calibration.accel.bias_z'] input")
    until("the parameter has it", lambda: abs(float(bias.input_value())) > 0.01)
    page.fill("#parameter-search", "")


def duty(page: Page) -> float:
    shown = page.locator("#strips figure", has_text="Motor duty").locator("b").nth(1).inner_text()
    return float(shown) if shown != "–" else 0.0


def turns_a_motor(page: Page, picture) -> None:
    page.click("#tab-motors")
    button = page.locator("#motor-1")
    box = button.bounding_box()
    page.mouse.move(box["x"] + 20, box["y"] + 20)
    page.mouse.down()
    page.wait_for_timeout(500)
    assert duty(page) == 0, "it turns although nobody said that the propellers are off"
    page.mouse.up()
    page.check("#motor-safe")
    page.mouse.move(box["x"] + 20, box["y"] + 20)
    page.mouse.down()
    until("the motor turns", lambda: duty(page) > 5)
    picture("motors")
    # Longer than the vehicle's own limit: it is asked for again.
    page.wait_for_timeout(2500)
    assert duty(page) > 5, "it stopped although it was held"
    page.mouse.up()
    until("it stops when it is let go", lambda: duty(page) == 0, 1)
    page.mouse.down()
    until("the motor turns", lambda: duty(page) > 5)
    page.keyboard.press("x")
    until("it stops with any key", lambda: duty(page) == 0, 1)
    page.mouse.up()
    button.focus()
    page.keyboard.down(" ")
    until("a key turns it, too", lambda: duty(page) > 5)
    page.keyboard.up(" ")
    until("and stops it", lambda: duty(page) == 0, 1)


def flies_by_hand(page: Page, picture) -> None:
    page.click("#vehicles button:nth-child(2)")
    page.click("#tab-fly")
    page.click("#by-keyboard")
    until("it may be armed", lambda: page.is_visible("#ready"), 60)
    page.keyboard.press("e")
    until("armed by hand", lambda: text(page, "armed") == "ARMED")
    page.keyboard.down("w")
    until("climbed by hand", lambda: figure(page, "height") > 0.3)
    page.keyboard.up("w")
    page.keyboard.down("ArrowUp")
    until("flown forward", lambda: figure(page, "north") > 0.3)
    picture("by-hand")
    page.keyboard.up("ArrowUp")
    # Also of a vehicle that is not chosen.
    page.click("#vehicles button:nth-child(1)")
    page.keyboard.press("Shift+Escape")
    page.click("#vehicles button:nth-child(2)")
    until("motors off", lambda: text(page, "armed") == "disarmed", 2)


def slows_time(page: Page) -> None:
    def clock() -> float:
        return float(text(page, "clock").split()[0])

    page.select_option("#speed", "0.25")
    page.wait_for_timeout(500)
    before = clock()
    page.wait_for_timeout(2000)
    assert 0.2 < clock() - before < 0.9, clock() - before
    page.select_option("#speed", "1")


def address_of(program: subprocess.Popen) -> str:
    for line in program.stdout:
        if found := re.search(r"http://[\w.:\[\]]+", line):
            # Whatever it says later must not fill the pipe.
            threading.Thread(target=program.stdout.read, daemon=True).start()
            return found[0] + "/"
    raise AssertionError("the program ended without an address")


def main() -> None:
    arguments = argparse.ArgumentParser()
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
    page.click("#tab-fly")
    flies(page, picture)
    plays_a_stick_file(page, folder)
    injects_a_fault(page, picture)
    kills(page)
    opens_the_log(page, options.program[0], folder, picture)
    shows_every_topic(page, picture)
    asks_the_console(page)
    calibrates(page, picture)
    turns_a_motor(page, picture)
    flies_by_hand(page, picture)
    slows_time(page)
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
