"""Reads broadcast telemetry and the data stream: python read_streams.py TELEMETRY_PORT 127.0.0.1:STREAM_PORT"""

import functools
import operator
import socket
import struct
import sys
import time


def telemetry(port):
    """A second of broadcast packets: 50 of 140 bytes, 20 ms apart."""
    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    line.bind(("127.0.0.1", port))
    line.settimeout(2)
    packets = [line.recv(2048) for _ in range(50)]
    assert all(len(packet) == 140 for packet in packets)
    heads = [struct.unpack_from("<HBBI", packet) for packet in packets]
    assert all(head[:3] == (0xCAFE, 2, 1) for head in heads), heads[0]
    between = [after[3] - before[3] for before, after in zip(heads, heads[1:])]
    assert all(abs(step - 20_000) <= 5_000 for step in between), between
    force = struct.unpack_from("<3f", packets[-1], 32)
    assert -10.5 < force[2] < -9.0, force
    voltage = struct.unpack_from("<f", packets[-1], 104)[0]
    print(f"telemetry: 50 packets, specific force {force[2]:.2f} m/s^2 down, battery {voltage:.2f} V")


def stream(host, port):
    """Two seconds of the data stream: no packet missing, every check right, a control cycle every 2.5 ms."""
    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    line.settimeout(2)
    line.sendto(b"\xf0", (host, port))
    numbers, times, statuses = [], [], 0
    until = time.monotonic() + 2
    while time.monotonic() < until:
        packet = line.recv(2048)
        assert functools.reduce(operator.xor, packet) == 0, "a wrong check"
        kind, number, count = struct.unpack_from("<BHB", packet)
        if kind == 0x4F:
            statuses += 1
            continue
        assert (kind, count) == (0x50, 8) and len(packet) <= 1400, (kind, count, len(packet))
        numbers.append(number)
        times += [struct.unpack_from("<I", packet, 4 + 80 * cycle)[0] for cycle in range(8)]
        rest, entries = packet[4 + 8 * (80 + 28 + 6):-1], []
        for _ in range(rest[0]):
            entries.append(rest[1])
            rest = rest[:1] + rest[3 + rest[2]:]
        assert len(rest) == 1, "bytes after the last entry"
        assert {0x42, 0x4A, 0x4B} <= set(entries), entries
    line.sendto(b"\xf1", (host, port))
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "a packet is missing"
    steps = {after - before for before, after in zip(times, times[1:])}
    assert max(steps) <= 2_600 and min(steps) >= 2_400, steps
    assert len(numbers) > 80 and statuses > 0
    print(f"stream: {len(numbers)} packets, {len(times)} cycles, none missing; {statuses} status packets")


def main():
    telemetry(int(sys.argv[1]))
    host, port = sys.argv[2].split(":")
    stream(host, int(port))


main()
