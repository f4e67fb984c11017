"""A vehicle stands on the ground while other programs load its ports as far as they can.

    load.py SECONDS PROGRAM FOLDER

`PROGRAM serve` opens every port. Sixteen clients read slowly, eight download the log again and again,
and each UDP port is sent a thousand meaningless datagrams a second. Meanwhile one page and one
MAVLink station are served twenty times a second; the station has its answers within a second; memory
and disk stay flat. Prints the figures as JSON, also to FOLDER/figures.json. Exit code 0, or an exception that says what does not
hold.
"""

import asyncio
import json
import random
import re
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import websockets
from pymavlink import mavutil

RATE = 20
SLOW_READERS = 16
DOWNLOADS = 8
DATAGRAMS = 1_000
TOPICS = ["estimate_state", "flight_status", "sensor_power", "system_alert"]
# Memory may grow by so much from before the load on, and the disk may hold as much.
GROWTH = 20 << 20
# A second of the watched time in which fewer texts or messages came than this counts as a gap.
FEWEST = 15
# Ports that hear datagrams. MAVLink's is known only from what it sends.
UDP = ["tello", "stream", "sealed"]


class Program:
    """`stampfly serve`, and what it says of its ports."""

    def __init__(self, program: str, folder: Path) -> None:
        key = folder / "key"
        subprocess.run([program, "key", "new", str(key)], check=True, stdout=subprocess.DEVNULL)
        self.stations = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.stations.bind(("127.0.0.1", 0))
        ports = {name: 0 for name in ("http", "mavlink-tcp", "tello", "stream", "console", "msp", "usb-tcp", "sealed")}
        ports |= {"mavlink-udp": self.stations.getsockname()[1], "tello-state": "off", "telemetry": "off"}
        command = [program, "serve", "--key", str(key), "--out", str(folder / "logs")]
        command += [part for name, number in ports.items() for part in ("--port", f"{name}={number}")]
        self.logs = folder / "logs"
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.lines: list[str] = []
        threading.Thread(target=lambda: self.lines.extend(self.process.stdout), daemon=True).start()

    def port(self, name: str) -> int:
        pattern = re.compile(rf"^{name} .*127\.0\.0\.1:(\d+)")
        end = time.monotonic() + 30
        while time.monotonic() < end:
            for line in list(self.lines):
                if found := pattern.search(line):
                    return int(found[1])
            time.sleep(0.05)
        raise AssertionError(f"the port {name} is not said: {self.lines}")

    def memory(self) -> int:
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
            return int(re.search(r"VmRSS:\s+(\d+)", status.read())[1]) << 10

    def disk(self) -> int:
        return sum(path.stat().st_size for path in self.logs.rglob("*") if path.is_file())

    def processor(self) -> float:
        """Seconds of a processor that the program has taken."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / 100


class Station:
    """A ground station at the MAVLink port: what it receives, and how long its questions wait."""

    def __init__(self, port: int) -> None:
        self.line = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}", source_system=255, source_component=190)
        self.line.wait_heartbeat(timeout=10)

    def command(self, number: int, *values: float) -> None:
        """Says a command until the vehicle has done it."""
        end = time.monotonic() + 60
        while time.monotonic() < end:
            self.beat()
            parameters = [*values, *[0.0] * (7 - len(values))]
            self.line.mav.command_long_send(1, 1, number, 0, *parameters)
            answer = self.line.recv_match(type="COMMAND_ACK", blocking=True, timeout=3)
            if answer and answer.command == number and answer.result == 0:
                return
            time.sleep(0.5)
        raise AssertionError(f"command {number} was not done in a minute")

    def beat(self) -> None:
        self.line.mav.heartbeat_send(6, 8, 0, 0, 4)

    def hop(self) -> None:
        """Flies for a moment, so that there is a log to load."""
        self.command(mavutil.mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
        self.command(mavutil.mavlink.MAV_CMD_NAV_TAKEOFF, *[0.0] * 6, 0.5)
        for _ in range(5):
            self.beat()
            time.sleep(1.0)
        self.command(mavutil.mavlink.MAV_CMD_NAV_LAND)
        end = time.monotonic() + 30
        while time.monotonic() < end:
            self.beat()
            heartbeat = self.line.recv_match(type="HEARTBEAT", blocking=True, timeout=2)
            if heartbeat and not heartbeat.base_mode & 128:
                return
        raise AssertionError("the vehicle has not landed")

    def watch(self, until: float, gaps: list[int], waited: list[float]) -> None:
        """Counts attitudes of each second, and asks for a parameter once a second."""
        second, count, asked = time.monotonic() + 1, 0, None
        while time.monotonic() < until:
            message = self.line.recv_match(type=["ATTITUDE", "PARAM_VALUE"], blocking=True, timeout=1)
            now = time.monotonic()
            if message and message.get_type() == "ATTITUDE":
                count += 1
            elif message and asked is not None:
                waited.append(now - asked)
                asked = None
            if now >= second:
                gaps.append(count)
                count, second = 0, second + 1
                if asked is not None:
                    waited.append(now - asked)
                self.beat()
                asked = now
                self.line.mav.param_request_read_send(1, 1, b"rate.roll.kp", -1)


async def topics(port: int) -> list[str]:
    """Every topic that the vehicle has."""
    address = f"127.0.0.1:{port}"
    async with websockets.connect(f"ws://{address}/ws", origin=f"http://{address}", max_size=None) as line:
        return [topic["name"] for topic in json.loads(await line.recv())["hello"]["vehicles"][0]["topics"]]


async def page(port: int, until: float, counts: list[int]) -> None:
    """A page: the state, twenty times a second."""
    address = f"127.0.0.1:{port}"
    async with websockets.connect(f"ws://{address}/ws", origin=f"http://{address}", max_size=None) as line:
        await line.recv()
        await line.send(json.dumps({"id": 1, "do": "subscribe", "topics": TOPICS, "rate": RATE}))
        second, count = time.monotonic() + 1, 0
        while time.monotonic() < until:
            message = json.loads(await asyncio.wait_for(line.recv(), 5))
            count += "state" in message
            if time.monotonic() >= second:
                counts.append(count)
                count, second = 0, second + 1
                await line.send(json.dumps({"vehicle": 0, "id": 0, "do": "alive"}))


def slow_reader(port: int, until: float, names: list[str]) -> None:
    """A page that asks for everything and reads ten bytes a second. It comes again when it is closed."""
    head = (
        f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
    )
    text = json.dumps({"id": 1, "do": "subscribe", "topics": names, "rate": 50}).encode()
    frame = bytes([0x81, 0xFE]) + len(text).to_bytes(2, "big") + bytes(4) + text
    while time.monotonic() < until:
        try:
            with socket.socket() as line:
                # As little as the system gives, so that what is not read waits in the program.
                line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
                line.settimeout(5)
                line.connect(("127.0.0.1", port))
                line.sendall(head.encode())
                line.sendall(frame)
                while time.monotonic() < until and line.recv(10):
                    time.sleep(1)
        except OSError:
            time.sleep(0.1)


def download(port: int, until: float, totals: list[int]) -> None:
    """Loads the log again and again."""
    head = f"GET /log/0 HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()
    while time.monotonic() < until:
        try:
            with socket.create_connection(("127.0.0.1", port), 5) as line:
                line.settimeout(5)
                line.sendall(head)
                while data := line.recv(1 << 16):
                    totals[0] += len(data)
        except OSError:
            time.sleep(0.1)
        totals[1] += 1


def garbage(port: int, until: float, seed: int, sent: list[int]) -> None:
    """A thousand datagrams a second: noise, and the beginnings of frames."""
    chance = random.Random(seed)
    beginnings = [b"", b"\xfd", b"\xfe\x09", b"command", b"rc ", b"$M<", b"\x00" * 12]
    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    due = time.monotonic()
    while time.monotonic() < until:
        for _ in range(DATAGRAMS // 50):
            try:
                line.sendto(chance.choice(beginnings) + chance.randbytes(chance.randrange(200)), ("127.0.0.1", port))
                sent[0] += 1
            except OSError:
                pass
        due += 0.02
        time.sleep(max(due - time.monotonic(), 0))


def main() -> None:
    seconds, program, folder = float(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.rglob("*"):
        if old.is_file():
            old.unlink()
    serving = Program(program, folder)
    try:
        http, station = serving.port("http"), Station(serving.port("mavlink-tcp"))
        _, vehicle = serving.stations.recvfrom(2_000)
        station.hop()
        totals, sent, gaps, waited, counts = [0, 0], [0], [], [], []
        # The log of the flight is written for some seconds after it.
        time.sleep(20)
        names = asyncio.run(topics(http))
        until = time.monotonic() + seconds
        memory, disk, begun = serving.memory(), serving.disk(), serving.processor()
        jobs = [(slow_reader, http, until, names)] * SLOW_READERS + [(download, http, until, totals)] * DOWNLOADS
        numbers = [serving.port(name) for name in UDP] + [vehicle[1]]
        jobs += [(garbage, number, until, seed, sent) for seed, number in enumerate(numbers)]
        jobs += [(station.watch, until, gaps, waited), (lambda: asyncio.run(page(http, until, counts)),)]
        threads = [threading.Thread(target=job[0], args=job[1:], daemon=True) for job in jobs]
        for thread in threads:
            thread.start()
        most = [memory, disk]
        while time.monotonic() < until - 1:
            time.sleep(1)
            most = [max(most[0], serving.memory()), max(most[1], serving.disk())]
        busy = (serving.processor() - begun) / seconds
        for thread in threads:
            thread.join(30)
        assert serving.process.poll() is None, "the program has ended"
    finally:
        serving.process.send_signal(2)
        serving.process.wait(20)
    figures = {
        "seconds": seconds,
        "page_texts_per_s": sum(counts) / len(counts),
        "page_seconds_with_gaps": sum(count < FEWEST for count in counts),
        "station_attitudes_per_s": sum(gaps) / len(gaps),
        "station_seconds_with_gaps": sum(count < FEWEST for count in gaps),
        "station_longest_wait_s": max(waited),
        "memory_before_bytes": memory,
        "memory_growth_bytes": most[0] - memory,
        "disk_bytes": most[1],
        "disk_growth_bytes": most[1] - disk,
        "processors": busy,
        "downloads": totals[1],
        "downloaded_bytes": totals[0],
        "datagrams_per_s": sent[0] / seconds,
    }
    said = json.dumps({name: round(value, 2) for name, value in figures.items()}, indent=1)
    print(said)
    (folder / "figures.json").write_text(said + "\n", encoding="ascii")
    assert figures["page_texts_per_s"] >= 0.95 * RATE, "the page was served too seldom"
    assert figures["station_attitudes_per_s"] >= 0.95 * RATE, "the station was served too seldom"
    assert figures["station_longest_wait_s"] <= 1.0, "a question waited for more than a second"
    assert figures["memory_growth_bytes"] <= GROWTH, "memory grows"
    assert figures["disk_bytes"] <= GROWTH, "disk grows"
    assert figures["datagrams_per_s"] >= 0.9 * DATAGRAMS * len(numbers), "this machine could not send as much"


main()
