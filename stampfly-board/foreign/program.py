"""The firmware's program for a core that has not all of the ESP32-C6's registers.

labwired loads an ELF file itself. What its core lacks is made good in a copy of the file, instruction by instruction: nothing
of the firmware's source is changed, nor any other bit of its program.

| instruction | in the copy | why |
|---|---|---|
| access to a debug trigger (CSR 0x7A0 to 0x7A5) | reads zero, writes nothing | the core takes it for illegal |
| write of `mie` | sets `mstatus.MIE` | see `interrupts.py`; the boot loader leaves it set, and there is none here |
| the first of a function of the radio's library | `return 0` | the radio's analog parts are not modelled, and its start waits for them |
"""

import re
import struct

TRIGGERS = range(0x7A0, 0x7A6)
SET_MIE = 0x3004_6073  # csrsi mstatus, 8
RETURN_ZERO = struct.pack("<HH", 0x4501, 0x8082)  # c.li a0, 0; c.jr ra
SILENT_RADIO = re.compile(r"(esp_wifi|esp_now)_\w+|register_chipv7_phy|chip_v7_set_chan")


class Program:
    """A little-endian 32-bit ELF file."""

    def __init__(self, data: bytes):
        self.data = bytearray(data)
        (at,) = struct.unpack_from("<I", self.data, 32)
        size, count = struct.unpack_from("<HH", self.data, 46)
        # Of each section: name, type, flags, address, offset, size, link.
        self.sections = [struct.unpack_from("<7I", self.data, at + size * number) for number in range(count)]

    def loaded(self):
        """Address, place in the file and size of all that is loaded or described there."""
        for _, kind, _, address, offset, size, _ in self.sections:
            if kind == 1 and address and size:
                yield address, offset, size

    def symbols(self, function: bool = False):
        """Every symbol, or every function: its name, its address, its size."""
        for _, kind, _, _, offset, size, link in self.sections:
            if kind == 2:
                names = self.sections[link][4]
                for at in range(offset, offset + size, 16):
                    name, address, length, info = struct.unpack_from("<3IB", self.data, at)
                    if function and info & 0xF != 2:
                        continue
                    end = self.data.index(0, names + name)
                    yield self.data[names + name : end].decode(), address, length

    def symbol(self, end: str):
        """Address and size of the one symbol whose name ends so."""
        found = {(address, size) for name, address, size in self.symbols() if name.endswith(end) and size}
        if len(found) != 1:
            raise LookupError(f"{len(found)} symbols end in {end}")
        return found.pop()

    def write(self, address: int, data: bytes):
        for start, offset, size in self.loaded():
            if start <= address < start + size:
                at = offset + address - start
                self.data[at : at + len(data)] = data
                return
        raise LookupError(f"nothing is loaded at {address:#x}")

    def adapt(self):
        """Makes the copy, and says how many instructions and functions were exchanged."""
        exchanged = 0
        for _, kind, flags, _, at, size, _ in self.sections:
            end = at + size
            while kind == 1 and flags & 4 and at + 4 <= end:
                if self.data[at] & 3 != 3:
                    at += 2
                    continue
                (word,) = struct.unpack_from("<I", self.data, at)
                csr = word >> 20 if word & 0x7F == 0x73 and word >> 12 & 3 else None
                if csr in TRIGGERS:
                    struct.pack_into("<I", self.data, at, word & 0xF80 | 0x13)  # addi rd, zero, 0
                    exchanged += 1
                elif csr == 0x304 and word & 0x707F == 0x1073:
                    struct.pack_into("<I", self.data, at, SET_MIE)
                    exchanged += 1
                at += 4
        radio = {address for name, address, _ in self.symbols(function=True) if SILENT_RADIO.fullmatch(name)}
        for address in radio:
            self.write(address, RETURN_ZERO)
        return exchanged, len(radio)
