"""The page that has a vehicle inside, in a real browser without a server: flies, breaks something, looks back, flies again.

    demo.py [--pictures FOLDER] FILE HASH

FILE is the page, HASH what the reference mission has on this machine. Exit code 0, or an exception that says what is not as it
should be.
"""

import argparse
import json
from pathlib import Path

from page import CHROMIUM, Watched, figure, flies, injects_a_fault, text, until
from playwright.sync_api import Page, sync_playwright

# Simulated seconds in a second of the wall that the reference mission has at least.
FASTEST = 20.0


def reference(page: Page, expected: str) -> None:
    said = page.evaluate("window.flyReference(1)")
    speed = said["duration_s"] / said["wall_s"]
    print(f"reference mission: hash {said['log_hash']}, {said['duration_s']:.1f} s at {speed:.0f} x real time")
    assert said["log_hash"] == expected, f"{said['log_hash']} in the browser, {expected} on this machine"
    assert speed >= FASTEST, f"{speed:.1f} x real time"
    another = page.evaluate("window.flyReference(2)")
    assert another["log_hash"] != expected, "another seed is the same flight"


def looks_back(page: Page, picture) -> None:
    page.click("#tab-log")
    page.click("#look-back")
    until("the flight so far is open", lambda: page.is_visible("#player"))
    slider = page.locator("#slider")
    first, last = float(slider.get_attribute("min")), float(slider.get_attribute("max"))
    assert last - first > 10, (first, last)
    highest = 0.0
    for step in range(11):
        slider.fill(str(first + (last - first) * step / 10))
        slider.dispatch_event("input")
        page.wait_for_timeout(60)
        highest = max(highest, figure(page, "height"))
    assert highest > 0.4, f"the log never rises above {highest} m"
    picture("look-back")
    page.click("#live")
    until("back to live", lambda: not page.is_visible("#player"))


def downloads(page: Page, folder: Path) -> None:
    with page.expect_download() as download:
        page.click("#download")
    path = folder / "demo.ulg"
    download.value.save_as(path)
    assert path.stat().st_size > 1_000_000, path.stat().st_size
    print(path)


def flies_again(page: Page, picture) -> None:
    page.click("#tab-parameters")
    page.fill("#parameter-search", "altitude.alt.kp")
    value = page.locator("#parameters tr[data-name='altitude.alt.kp']:visible input")
    value.fill("0.3")
    value.press("Enter")
    row = page.locator("#parameters tr[data-name='altitude.alt.kp']:visible")
    until("the value is taken", lambda: row.locator(".note").inner_text() == "✓")
    page.select_option("#speed", "4")
    page.click("#fly-again")
    until("two vehicles", lambda: page.locator("#vehicles button").count() == 2)
    until("it flies again", lambda: text(page, "phase") in ("flying", "taking off", "landing"), 60)
    page.wait_for_timeout(1500)
    picture("again")
    until("it has landed again", lambda: text(page, "phase") == "on the ground" and text(page, "armed") == "disarmed", 90)


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--pictures", type=Path)
    arguments.add_argument("file", type=Path)
    arguments.add_argument("hash")
    options = arguments.parse_args()

    def picture(name: str) -> None:
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=options.pictures / f"demo-{name}.png")

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1400, "height": 900}, accept_downloads=True)
        address = options.file.resolve().as_uri()
        watched = Watched(page, address)
        page.goto(address)
        until("the vehicle is there", lambda: page.locator("#chosen").inner_text() == "StampFly")
        reference(page, options.hash)
        flies(page, picture)
        injects_a_fault(page, picture)
        page.click("#land")
        until("landed", lambda: text(page, "armed") == "disarmed")
        looks_back(page, picture)
        downloads(page, options.file.parent)
        flies_again(page, picture)
        watched.check()
        print(json.dumps({"flown": True}))
        browser.close()


main()
