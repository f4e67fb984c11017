"""Ten vehicles in one world, watched for a long time: no state may be missing, and memory must not grow.

    soak.py SECONDS PROGRAM ARGUMENT...

PROGRAM flies the vehicles and prints the address of its page. A client as a page is takes the state of all of them twenty times a
second; each vehicle is kept busy. Exit code 0, or an exception that says what is not as it should be.
"""

import asyncio
import json
import re
import subprocess
import sys
import time

import websockets

RATE = 20
TOPICS = ["estimate_state", "flight_status", "actuator_motor", "sensor_power", "system_alert"]
# Memory in the last tenth of the time may be so much above that in the second tenth.
GROWTH = 1.05


def resident(process: int) -> int:
    with open(f"/proc/{process}/status", encoding="ascii") as status:
        return int(re.search(r"VmRSS:\s+(\d+)", status.read())[1])


async def watch(address: str, seconds: float, process: int) -> None:
    async with websockets.connect(f"ws://{address}/ws", origin=f"http://{address}", max_size=None) as line:
        hello = json.loads(await line.recv())["hello"]
        vehicles = len(hello["vehicles"])
        await line.send(json.dumps({"id": 1, "do": "subscribe", "topics": TOPICS, "rate": RATE}))
        begun = time.monotonic()
        texts, dropped, memory, last, slowest = 0, 0, [], begun, 0.0
        clocks = [[] for _ in range(vehicles)]
        beat, asked = begun, 100
        while time.monotonic() - begun < seconds:
            message = json.loads(await line.recv())
            now = time.monotonic()
            if now > beat:
                beat += 0.5
                for vehicle in range(vehicles):
                    await line.send(json.dumps({"vehicle": vehicle, "id": 0, "do": "alive"}))
                if int(2 * (now - begun)) % 60 == 20:
                    for vehicle in range(vehicles):
                        asked += 1
                        await line.send(json.dumps({"vehicle": vehicle, "id": asked, "do": "guided", "kind": "arm"}))
                        asked += 1
                        rise = {"do": "guided", "kind": "take_off", "height": 0.5}
                        await line.send(json.dumps({"vehicle": vehicle, "id": asked, **rise}))
                if int(2 * (now - begun)) % 60 == 50:
                    for vehicle in range(vehicles):
                        asked += 1
                        await line.send(json.dumps({"vehicle": vehicle, "id": asked, "do": "guided", "kind": "land"}))
            if "state" not in message:
                continue
            texts += 1
            dropped = message["dropped"]
            slowest, last = max(slowest, now - last), now
            for number, clock, *_ in message["state"]:
                clocks[number].append(clock)
            if texts % RATE == 0:
                memory.append(resident(process))
        passed = time.monotonic() - begun
        flown = [clock[-1] - clock[0] for clock in clocks]
        tenth = max(len(memory) // 10, 1)
        early, late = max(memory[tenth:2 * tenth]), max(memory[-tenth:])
        print(f"{vehicles} vehicles, {passed:.0f} s: {texts} texts of state ({texts / passed:.1f} a second), {dropped} dropped, "
              f"longest pause {slowest:.3f} s")
        print(f"flown {min(flown):.1f} to {max(flown):.1f} s each; memory {early} kB, at the end {late} kB")
        assert vehicles == 10 and dropped == 0, (vehicles, dropped)
        assert texts >= 0.97 * RATE * passed, f"{texts} texts in {passed:.0f} s"
        assert min(flown) >= 0.98 * passed, f"{min(flown):.1f} s flown in {passed:.0f} s"
        assert late <= GROWTH * early, f"memory grows: {early} kB, {late} kB"


def main() -> None:
    seconds, command = float(sys.argv[1]), sys.argv[2:]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        try:
            address = None
            while address is None:
                found = re.search(r"open http://(\S+)", program.stdout.readline())
                address = found and found[1]
            asyncio.run(watch(address, seconds, program.pid))
        finally:
            program.terminate()


main()
