"""labwired's ESP32-C6 with what it lacks, and the firmware in it."""

import os
import re
import tempfile
import tomllib
from pathlib import Path

import labwired
from program import Program

HERE = Path(__file__).parent
CONFIGS = Path(labwired.__file__).parent / "configs"
ROM = range(0x4000_0000, 0x4005_0000)
MEMORY = range(0x4080_0000, 0x4088_0000)


def lacking() -> dict:
    return tomllib.loads((HERE / "lacking.toml").read_text())


def registers(window: dict) -> str:
    """The description of a window, register by register."""
    reset = {int(offset, 0): value for offset, value in window.get("reset", {}).items()}
    text = f"peripheral: {window['name']}\nversion: '1'\nregisters:\n"
    for offset in range(0, window["size"], 4):
        action = "write_one_to_clear" if offset in window.get("done", []) else "null"
        text += (
            f"- {{id: R{offset:04X}, address_offset: {offset}, size: 32, access: READ_WRITE, reset_value: {reset.get(offset, 0)},"
            f" side_effects: {{read_action: null, write_action: {action}}}}}\n"
        )
    return text


def description(folder: Path, without: tuple[str, ...] = ()) -> Path:
    """Writes labwired's ESP32-C6 with what it lacks, except these parts of it or of that."""
    parts = lacking()
    chip = (CONFIGS / "chips/esp32c6.yaml").read_text().rstrip() + "\n"
    # Timers that have alarms. Interrupts are `interrupts.py`'s: labwired would put them on lines that this chip has not.
    chip = chip.replace('type: "esp32c6_mwdt"', 'type: "esp32s3_timer_group"')
    chip = re.sub(r"(?m)^ {4}irq: .*\n", "", chip)
    for name in without:
        chip = re.sub(rf'(?ms)^  - id: "{name}"\n.*?(?=^  - id: |\Z)', "", chip)
    windows = parts["window"] + [{"name": name, "base": 0x6009_1000, "size": 0x1000} for name in without if name == "gpio"]
    for window in windows:
        path = folder / f"{window['name']}.yaml"
        path.write_text(registers(window))
        chip += f'  - id: "{window["name"]}_window"\n    type: "declarative"\n    base_address: {window["base"]:#x}\n'
        chip += f'    size: "{window["size"]}B"\n    config: {{ path: "{path}" }}\n'
    for model in parts["model"]:
        chip += f'  - id: "{model["name"]}"\n    type: "{model["type"]}"\n'
        chip += f'    base_address: {model["base"]:#x}\n    size: "{model["size"]}B"\n'
    (folder / "chip.yaml").write_text(chip)
    sensors = [sensor for sensor in parts["sensor"] if sensor["name"] not in without]
    listed = "".join(
        f"- {{id: {s['name']}, type: {s['type']}, connection: i2c0, route: {{sda: {s['sda']}, scl: {s['scl']}}}}}\n" for s in sensors
    )
    system = folder / "system.yaml"
    system.write_text(
        f'name: "esp32c6"\nchip: "{folder / "chip.yaml"}"\ncpu_hz: 160_000_000\n'
        f"external_devices:{chr(10) + listed if listed else ' []' + chr(10)}board_io: []\n"
    )
    return system


class Board:
    """A machine at reset: mask ROM, its data in memory as its start-up code leaves them, and a program."""

    def __init__(self, program: Program, rom: Program, without: tuple[str, ...] = ()):
        self.folder = tempfile.TemporaryDirectory()
        folder = Path(self.folder.name)
        image = bytearray(len(ROM))
        for address, offset, size in rom.loaded():
            if address in ROM:
                image[address - ROM.start : address - ROM.start + size] = rom.data[offset : offset + size]
        (folder / "rom.bin").write_bytes(image)
        (folder / "program.elf").write_bytes(program.data)
        os.environ["LABWIRED_ESP32C6_ROM"] = str(folder / "rom.bin")
        self.sim = labwired.Sim(folder / "program.elf", system=description(folder, without))
        for address, offset, size in rom.loaded():
            if address in MEMORY:
                for at in range(0, size & ~3, 4):
                    word = int.from_bytes(rom.data[offset + at : offset + at + 4], "little")
                    self.sim.write_u32(address + at, word)

    def run(self, cycles: int):
        """Runs so many cycles of 6.25 ns, without interrupts."""
        self.sim.run_for(f"{cycles * 6250 // 1000}ns")

    def words(self, address: int, count: int) -> list[int]:
        data = self.sim.read_memory(address, 4 * count)
        return [int.from_bytes(data[at : at + 4], "little") for at in range(0, len(data), 4)]
