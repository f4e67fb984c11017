"""Writes vectors/secure.json: keys, a handshake and frames of the secure session, made by another implementation.

    python3 -m venv venv && venv/bin/pip install cryptography
    venv/bin/python stampfly-link/tests/secure_vectors.py            # compares with the file
    venv/bin/python stampfly-link/tests/secure_vectors.py --fix      # writes it

The ciphers are those of the package `cryptography` (OpenSSL); HChaCha20 is computed from its ChaCha20 as the difference of the
block and what the block began with, and checked with the vector of draft-irtf-cfrg-xchacha-03, section 2.2.1. Nothing here is
shared with the crate but the table in the documentation of `stampfly_link::secure`.
"""

import json
import struct
import sys
import zlib
from pathlib import Path

from cryptography.hazmat.primitives.ciphers import Cipher, algorithms
from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305

FILE = Path(__file__).parent / "vectors" / "secure.json"
TO_VEHICLE, FROM_VEHICLE = 1, 2


def hchacha20(key, purpose):
    block = Cipher(algorithms.ChaCha20(key, purpose), mode=None).encryptor().update(bytes(64))
    words = struct.unpack("<16I", block)
    constants = struct.unpack("<4I", b"expand 32-byte k")
    before = constants + struct.unpack("<8I", key) + struct.unpack("<4I", purpose)
    after = [(word - start) % 2**32 for word, start in zip(words, before)]
    return struct.pack("<8I", *after[:4], *after[12:])


def frame(key, direction, kind, key_id, session, counter, tick, body):
    head = struct.pack("<BBBII", 1, kind, key_id, session, counter)
    nonce = struct.pack("<B3xII", direction, session, counter)
    return head + ChaCha20Poly1305(key).encrypt(nonce, struct.pack("<I", tick) + body, head)


def uri(key_id, key):
    return f"stampfly://key?id={key_id}&key={key.hex()}&sum={zlib.crc32(bytes([key_id]) + key):08x}"


def telemetry():
    body = struct.pack("<BBBHhhhhhhhBB", 0xAA, 1, 7, 3850, 120, 100, -200, 300, 10, -20, 900, 3, 1)
    return body + bytes([sum(body) % 256])


def vectors():
    draft = bytes(range(32)), bytes.fromhex("000000090000004a0000000031415927")
    expected = "82413b4227b27bfed30e42508a877d73a0f9e4d58a74a853c12ec41326d3ecdc"
    assert hchacha20(*draft).hex() == expected

    key, key_id = bytes((7 * place + 3) % 256 for place in range(32)), 9
    of_vehicle, of_station = bytes.fromhex("0123456789abcdef"), bytes.fromhex("f0e1d2c3b4a59687")
    handshake = hchacha20(key, b"stampfly-secure1")
    session_key = hchacha20(key, of_vehicle + of_station)
    session = struct.unpack("<I", of_vehicle[:4])[0]
    vehicle_number = struct.unpack("<II", of_vehicle)
    station_number = struct.unpack("<II", of_station)

    to, by = TO_VEHICLE, FROM_VEHICLE
    text = "höhe 1.5 m\n".encode()
    # Name, direction, kind, counter, tick, body. The vehicle's clock is 20 ms at its welcome, and the station's never behind.
    bodies = [
        ("welcome", by, 0x82, 1, 20, b""),
        ("ready", to, 0x02, 1, 20, b""),
        ("sticks", to, 0x10, 2, 20, struct.pack("<ffffBB", 0.25, -1.0, 0.0, 0.5, 2, 1)),
        ("guided", to, 0x11, 3, 20, struct.pack("<Bffffff", 4, 1.0, -2.0, -1.5, 0.75, 0.5, 2.0)),
        ("kill", to, 0x12, 4, 20, b""),
        ("read parameter", to, 0x20, 5, 20, struct.pack("<H", 513)),
        ("write parameter", to, 0x21, 6, 20, struct.pack("<Hf", 513, -0.125)),
        ("line", to, 0x30, 7, 20, text),
        ("telemetry", by, 0x90, 2, 20, telemetry()),
        ("parameter", by, 0xA0, 3, 20, struct.pack("<HfB", 513, -0.125, 0)),
        ("reply", by, 0xB0, 4, 20, b"\x01" + text),
        ("sample", by, 0xC0, 5, 20, struct.pack("<HQIII", 12, 1_234_567_890_123, 1, 0xFFFFFFFF, 0x3F800000)),
        ("acknowledgement", by, 0xD0, 6, 20, struct.pack("<IB", 4, 1)),
        ("numbered", to, 0x13, 8, 20, struct.pack("<IBffffff", 0xDEADBEEF, 4, 1.0, -2.0, -1.5, 0.75, 0.5, 2.0)),
        ("question", to, 0x31, 9, 20, struct.pack("<IH", 0xDEADBEEF, 240) + text),
        ("part", by, 0xB1, 7, 20, struct.pack("<IHB", 0xDEADBEEF, 240, 1) + text),
        ("longest reply", by, 0xB0, 8, 20, b"\x00" + b"x" * 218),
    ]
    frames = [
        {"name": name, "to_vehicle": direction == to, "body": body.hex(),
         "frame": frame(session_key, direction, kind, key_id, session, counter, tick, body).hex()}
        for name, direction, kind, counter, tick, body in bodies
    ]
    return {
        "source": "secure_vectors.py: Python cryptography (OpenSSL), zlib",
        "draft": {"key": draft[0].hex(), "purpose": draft[1].hex(), "derived": expected},
        "key": key.hex(),
        "key_id": key_id,
        "uri": uri(key_id, key),
        "of_vehicle": of_vehicle.hex(),
        "of_station": of_station.hex(),
        "announcement": frame(handshake, by, 0x81, key_id, *vehicle_number, 0, b"").hex(),
        "join": frame(hchacha20(handshake, of_vehicle + bytes(8)), to, 0x01, key_id, *station_number, 0, b"").hex(),
        "frames": frames,
    }


def main():
    text = json.dumps(vectors(), indent=2, ensure_ascii=True) + "\n"
    if "--fix" in sys.argv[1:]:
        FILE.write_text(text)
    elif FILE.read_text() != text:
        sys.exit(f"{FILE.name} is out of date")


if __name__ == "__main__":
    main()
