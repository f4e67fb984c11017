"""A web page of another site tries to fly a vehicle: through every TCP port, in a real browser.

    foreign.py PROGRAM FOLDER

The page sends what would arm the vehicle, stop its motors and change parameters, in every language, with
`fetch`, a form with a file, a form with text, and a WebSocket: first to the ports of `stampfly serve`, then to
those of `stampfly connect`, behind which is another vehicle; while the vehicle stands, and while it flies by the
station's own page. Nothing may change, and every connection to a port that does not speak HTTP is counted. Exit
code 0, or an exception that says what is not as it should be.
"""

import base64
import http.server
import json
import re
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from page import CHROMIUM, figure, text, until
from playwright.sync_api import BrowserContext, Page, sync_playwright

PARAMETER = "rate.roll.kp"
# Messages by number: their checksum ends with a byte of their own.
EXTRA = {0: 50, 23: 168, 76: 152}
# As much as a browser sends in one piece, and far more: what comes late must not be obeyed either.
REPEATS = (1, 20_000)

PAGE = """<!doctype html><meta charset="utf-8"><title>another site</title><script>
const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
const form = async (address, kind, body) => {
  const frame = Object.assign(document.createElement('iframe'), { name: `f${Math.random()}` });
  const node = Object.assign(document.createElement('form'), { action: address, method: 'post', enctype: kind, target: frame.name });
  const field = document.createElement(kind === 'text/plain' ? 'textarea' : 'input');
  field.name = 'x';
  if (kind === 'text/plain') field.value = `\\n${body}\\n`;
  else {
    field.type = 'file';
    const list = new DataTransfer();
    list.items.add(new File([body], 'x'));
    field.files = list.files;
  }
  node.append(field);
  document.body.append(frame, node);
  node.submit();
  await wait(400);
};
window.attack = async (port, payload, lines) => {
  const address = `http://127.0.0.1:${port}/`, body = bytes(payload);
  const options = { method: 'POST', mode: 'no-cors', headers: { 'Content-Type': 'text/plain' }, body: new Blob([body]) };
  await Promise.race([fetch(address, options).catch(() => {}), wait(2000)]);
  await form(address, 'multipart/form-data', body);
  await form(address, 'text/plain', lines);
  await new Promise((done) => {
    const socket = new WebSocket(`ws://127.0.0.1:${port}/ws`);
    const say = () => socket.send(JSON.stringify({ vehicle: 0, id: 1, do: 'guided', kind: 'arm' }));
    socket.addEventListener('open', say);
    socket.addEventListener('close', done);
    setTimeout(done, 2000);
  });
};
</script><body>"""


def checksum(data: bytes) -> int:
    value = 0xFFFF
    for byte in data:
        byte ^= value & 0xFF
        byte = (byte ^ (byte << 4)) & 0xFF
        value = (value >> 8) ^ (byte << 8) ^ (byte << 3) ^ (byte >> 4)
    return value & 0xFFFF


def frame(number: int, payload: bytes) -> bytes:
    """A frame of MAVLink 2, of a ground station."""
    body = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 255, 190, number & 0xFFFF, number >> 16) + payload
    return b"\xfd" + body + struct.pack("<H", checksum(body + bytes([EXTRA[number]])))


def question(number: int, payload: bytes) -> bytes:
    """A question of MSP 1."""
    body = bytes([len(payload), number]) + payload
    total = 0
    for byte in body:
        total ^= byte
    return b"$M<" + body + bytes([total])


def payload(repeats: int) -> bytes:
    heartbeat = frame(0, struct.pack("<IBBBBB", 0, 6, 8, 0, 4, 3))
    gain = frame(23, struct.pack("<fBB16sB", 0.00045, 1, 1, PARAMETER.encode(), 9))
    arm = frame(76, struct.pack("<7fHBBB", 1, 0, 0, 0, 0, 0, 0, 400, 1, 1, 0))
    rise = frame(76, struct.pack("<7fHBBB", 0, 0, 0, 0, 0, 0, 1, 22, 1, 1, 0))
    kill = frame(76, struct.pack("<7fHBBB", 0, 21196, 0, 0, 0, 0, 0, 400, 1, 1, 0))
    typed = f"\r\nparam set {PARAMETER} 0.00045\r\nkill\r\n".encode()
    gains = question(202, bytes([1, 1, 1] * 10))
    return (heartbeat + gain + arm + rise + kill + typed + gains) * repeats


class Site(http.server.BaseHTTPRequestHandler):
    """The other site: one page."""

    def do_GET(self) -> None:
        body = PAGE.encode()
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        pass


class Program:
    """A program, what it says of its ports, and how many connections it has ended."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.lines: list[str] = []
        for stream in (self.process.stdout, self.process.stderr):
            threading.Thread(target=self.read, args=(stream,), daemon=True).start()

    def read(self, stream) -> None:
        self.lines.extend(stream)

    def port(self, name: str) -> int:
        pattern = re.compile(rf"^{name} .*127\.0\.0\.1:(\d+)")
        found: list[int] = []

        def look() -> bool:
            found.extend(int(match[1]) for line in list(self.lines) if (match := pattern.search(line)))
            return bool(found)

        until(f"the port {name}", look)
        return found[0]

    def ended(self) -> int:
        """Stops it, and returns how many connections it has ended."""
        self.process.send_signal(2)
        self.process.wait(20)
        time.sleep(0.2)
        counts = [int(match[1]) for line in self.lines if (match := re.search(r"^(\d+) connections? ended", line))]
        return sum(counts)


def unchanged(page: Page, kp: float) -> None:
    page.wait_for_timeout(1500)
    assert text(page, "armed") == "disarmed", "the other site has armed the vehicle"
    assert abs(figure(page, "height")) < 0.05, "the other site has lifted the vehicle"
    assert gain(page) == kp, "the other site has changed a parameter"


def take_off(page: Page) -> None:
    page.click("#tab-fly")
    page.click("#arm")
    until("the vehicle is armed", lambda: text(page, "armed") == "ARMED")
    page.fill("#height", "0.6")
    page.click("#take-off")
    until("the vehicle hovers", lambda: figure(page, "height") > 0.5)


def flies(page: Page) -> None:
    page.wait_for_timeout(1500)
    assert text(page, "armed") == "ARMED" and figure(page, "height") > 0.3, "the other site has ended the flight"


def gain(page: Page) -> float:
    page.click("#tab-parameters")
    page.fill("#parameter-search", PARAMETER)
    value = page.locator(f"#parameters tr[data-name='{PARAMETER}'] input")
    until("the parameter is shown", lambda: value.count() == 1)
    shown = float(value.input_value())
    page.fill("#parameter-search", "")
    return shown


def attacked(context: BrowserContext, program: Program, ports: list[str], site: str) -> int:
    """Attacks these ports, and returns how many connections were opened to those that do not speak HTTP."""
    own = context.new_page()
    own.goto(f"http://127.0.0.1:{program.port('http')}/")
    until("the vehicle may be armed", lambda: own.is_visible("#ready"), 60)
    before = gain(own)
    foreign = context.new_page()
    attempts = 0
    lines = f"\nparam set {PARAMETER} 0.00045\n"
    for name in ports:
        for repeats in REPEATS:
            foreign.goto(site)
            body = base64.b64encode(payload(repeats)).decode()
            foreign.evaluate("([port, body, lines]) => attack(port, body, lines)", [program.port(name), body, lines])
            attempts += 4 if name != "http" else 0
            unchanged(own, before)
    take_off(own)
    for name in ports:
        foreign.goto(site)
        body = base64.b64encode(payload(1)).decode()
        foreign.evaluate("([port, body, lines]) => attack(port, body, lines)", [program.port(name), body, "\nkill\n"])
        attempts += 4 if name != "http" else 0
        flies(own)
    own.click("#land")
    until("the vehicle has landed", lambda: text(own, "armed") == "disarmed")
    unchanged(own, before)
    foreign.close()
    own.close()
    return attempts


def main() -> None:
    program, out = sys.argv[1], Path(sys.argv[2])
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Site)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    site = f"http://127.0.0.1:{server.server_port}/"
    with sync_playwright() as playwright, tempfile.TemporaryDirectory(dir=out) as folder:
        arguments = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        names = ["http", "mavlink-tcp", "console", "msp", "usb-tcp"]
        ports = [part for name in names for part in ("--port", f"{name}=0")]
        serving = Program(program, "serve", "--out", folder, "--port", "others=off", *ports)
        attempts = attacked(browser.new_context(), serving, names, site)
        place = f"tcp:127.0.0.1:{serving.port('usb-tcp')}"
        ports = ["--port", "http=0", "--port", "mavlink-udp=off"]
        closed = Program(program, "connect", place, "--out", folder, *ports, "--for", "3")
        closed.process.wait(20)
        assert not any(line.startswith("mavlink-tcp") for line in closed.lines), "a port that was not asked for is open"
        connected = Program(program, "connect", place, "--out", folder, *ports, "--port", "mavlink-tcp=0")
        behind = attacked(browser.new_context(), connected, ["http", "mavlink-tcp"], site)
        browser.close()
        for name, counted, expected in (("connect", connected.ended(), behind), ("serve", serving.ended(), attempts)):
            print(json.dumps({"program": name, "attempts": expected, "ended": counted}))
            assert counted >= expected, f"{name}: {expected} attempts, and {counted} connections ended"


main()
