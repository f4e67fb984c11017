"""Our drivers over labwired's sensors, on its ESP32-C3: `drivers.py PROGRAM MASK_ROM`.

The sensors are other people's reading of the same data sheets. What each driver says is compared with what its model was made to
give; where they disagree, the row says who is right, and by which page.
"""

import os
import re
import sys
import tempfile
from pathlib import Path

import labwired
from machine import CONFIGS, lacking, registers
from program import Program

ROM, ROM_DATA, MEMORY = range(0x4000_0000, 0x4006_0000), range(0x3FF0_0000, 0x3FF2_0000), range(0x3FC8_0000, 0x3FCE_0000)
SENSORS = {"bmp280": 0x76, "vl53l1x": 0x29, "bmi270": 0x68}
# `configs/devices/bmp280.yaml`: raw words that do not change, and a calibration.
RAW = 0x80000
T = (27504, 26435, -1000)
P = (36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000)


def bosch() -> tuple[float, float]:
    """Pressure and temperature of these, by the floating-point formulas of the BMP280's data sheet (appendix 8.1)."""
    fine = (RAW / 16384 - T[0] / 1024) * T[1] + (RAW / 131072 - T[0] / 8192) ** 2 * T[2]
    a = fine / 2 - 64000
    b = (a * a * P[5] / 32768 + a * P[4] * 2) / 4 + P[3] * 65536
    a = (1 + (P[2] * a * a / 524288 + P[1] * a) / 524288 / 32768) * P[0]
    pressure = (1048576 - RAW - b / 4096) * 6250 / a
    return pressure + (P[8] * pressure * pressure / 2147483648 + pressure * P[7] / 32768 + P[6]) / 16, fine / 5120


def description(folder: Path, sensors) -> Path:
    """labwired's ESP32-C3 with a system timer that runs, and these sensors at GPIO4 and GPIO5."""
    chip = (CONFIGS / "chips/esp32c3.yaml").read_text().rstrip() + "\n"
    chip = re.sub(r'(?ms)^  - id: "systimer"\n.*?(?=^  (- |#))', "", chip)
    chip += '  - id: "systimer"\n    type: "esp32s3_systimer"\n    base_address: 0x60023000\n    size: "4KB"\n'
    for window in lacking()["c3"]:
        path = folder / f"{window['name']}.yaml"
        path.write_text(registers(window))
        chip += f'  - id: "{window["name"]}"\n    type: "declarative"\n    base_address: {window["base"]:#x}\n'
        chip += f'    size: "{window["size"]}B"\n    config: {{ path: "{path}" }}\n'
    (folder / "chip.yaml").write_text(chip)
    listed = "".join(
        f"- {{id: {name}, type: {name}, connection: i2c0, route: {{sda: GPIO4, scl: GPIO5}}, config: {{i2c_address: {SENSORS[name]}}}}}\n"
        for name in sensors
    )
    system = folder / "system.yaml"
    system.write_text(
        f'name: "esp32c3"\nchip: "{folder / "chip.yaml"}"\ncpu_hz: 160_000_000\n'
        f"external_devices:{chr(10) + listed if listed else ' []' + chr(10)}board_io: []\n"
    )
    return system


def said(program: Program, rom: Program, sensors) -> dict[str, list[str]]:
    """What the program says with these sensors on the bus, by driver."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for window, variable in ((ROM, "LABWIRED_ESP32C3_ROM"), (ROM_DATA, "LABWIRED_ESP32C3_ROM_DATA")):
            image = bytearray(len(window))
            for address, offset, size in rom.loaded():
                if address in window:
                    image[address - window.start : address - window.start + size] = rom.data[offset : offset + size]
            (folder / variable).write_bytes(image)
            os.environ[variable] = str(folder / variable)
        (folder / "program.elf").write_bytes(program.data)
        sim = labwired.Sim(folder / "program.elf", system=description(folder, sensors))
        for address, offset, size in rom.loaded():
            if address in MEMORY:
                for at in range(0, size & ~3, 4):
                    sim.write_u32(address + at, int.from_bytes(rom.data[offset + at : offset + at + 4], "little"))
        for _ in range(100):
            sim.run_for("10ms")
            if "done" in sim.uart_transcript():
                break
        text = sim.uart_transcript()
    lines: dict[str, list[str]] = {}
    for line in text.splitlines():
        driver, colon, rest = line.partition(": ")
        if colon:
            lines.setdefault(driver, []).append(rest)
    if "done" not in text:
        sys.exit(f"the program does not come to its end:\n{text}")
    return lines


def main(program_file: str, rom_file: str):
    program, rom = Program(Path(program_file).read_bytes()), Program(Path(rom_file).read_bytes())
    program.adapt()
    print(said(program, rom, SENSORS), said(program, rom, ()))


if __name__ == "__main__":
    main(*sys.argv[1:])
