"""Bytes and JSON lines against the file that the Rust side writes, and whatever is no datagram."""

from __future__ import annotations

import doctest
import math
import random
import struct
import unittest
from enum import IntEnum, IntFlag
from typing import Any

import stampfly_rover
from stampfly_rover import (
    PARAMETERS,
    Components,
    Datagram,
    DatagramError,
    DriveCommand,
    InputMode,
    LogRecord,
    OperatorCommand,
    Reason,
    SafetyStatus,
)
from stampfly_rover.datagram import decimal, single
from stampfly_rover.messages import KINDS, Micros, Wire

from .vectors import load

VECTORS = load("datagrams.json")


def wire_name(wire: Wire) -> Any:
    """The file's name of a field's type."""
    if issubclass(wire, IntEnum):
        return [[member.name, member.value] for member in wire]
    if wire is Micros:
        return "u64"
    return {float: "f32", bool: "bool"}.get(wire, "u32")


class Vectors(unittest.TestCase):
    def test_every_kind_has_the_fields_of_the_rust_side(self) -> None:
        self.assertEqual(sorted(KINDS), [kind["kind"] for kind in VECTORS["kinds"]])
        for kind in VECTORS["kinds"]:
            message = KINDS[kind["kind"]]
            self.assertEqual(message.__name__, kind["name"])
            expected = [(name, wire) for name, wire, _ in kind["fields"]]
            actual = [(name, wire_name(wire)) for name, wire in message.FIELDS]
            # Enumerations may be declared in any order.
            self.assertEqual([(n, sorted(w) if isinstance(w, list) else w) for n, w in actual],
                             [(n, sorted(w) if isinstance(w, list) else w) for n, w in expected])
            # The dataclass has its fields in wire order, so positional arguments mean the same on both sides.
            self.assertEqual(list(message.__dataclass_fields__)[: len(expected)], [name for name, _ in expected])

    def test_parameters_and_components_are_the_rust_sides(self) -> None:
        self.assertEqual(list(PARAMETERS), [name for name, *_ in VECTORS["parameters"]])
        self.assertEqual([[member.name, member.value] for member in Components], VECTORS["components"])
        self.assertTrue(issubclass(Components, IntFlag))

    def test_bytes_and_lines_are_read_as_the_same_and_written_as_they_were(self) -> None:
        kinds = set()
        for vector in VECTORS["datagrams"]:
            data = bytes.fromhex(vector["bytes"])
            datagram = Datagram.from_bytes(data)
            kinds.add(datagram.message.KIND)
            self.assertEqual(Datagram.from_json(vector["line"]), datagram)
            self.assertEqual(Datagram.read(vector["line"].encode()), datagram)
            self.assertEqual(datagram.to_bytes(), data)
            self.assertEqual(Datagram.from_json(datagram.to_json()), datagram)
        self.assertEqual(kinds, set(KINDS))

    def test_what_the_rust_side_refuses_is_refused_for_the_same_reason(self) -> None:
        for data, reason in VECTORS["refused"]:
            with self.assertRaises(DatagramError, msg=data) as caught:
                Datagram.from_bytes(bytes.fromhex(data))
            self.assertEqual(caught.exception.reason.value, reason, data)
        for line, reason in VECTORS["refused_lines"]:
            with self.assertRaises(DatagramError, msg=line) as caught:
                Datagram.from_json(line)
            self.assertEqual(caught.exception.reason.value, reason, line)

    def test_the_csv_log_has_the_fields_of_the_record(self) -> None:
        header, line = VECTORS["csv"].splitlines()
        self.assertEqual(header.split(","), [name for name, _ in LogRecord.FIELDS])
        messages = [Datagram.from_json(vector["line"]).message for vector in VECTORS["datagrams"]]
        record = next(message for message in messages if isinstance(message, LogRecord) and message.t > 0.0)
        expected = [float(getattr(record, name)) for name, _ in LogRecord.FIELDS]
        self.assertEqual([single(float(text)) for text in line.split(",")], expected)


class Refusals(unittest.TestCase):
    GOOD = Datagram(7, 20_000, OperatorCommand(0.5, 0.25, -1.0, InputMode.Demo, True, False))

    def refused(self, line: str) -> Reason:
        with self.assertRaises(DatagramError, msg=line) as caught:
            Datagram.from_json(line)
        return caught.exception.reason

    def test_any_one_damaged_bit_is_noticed(self) -> None:
        data = self.GOOD.to_bytes()
        for bit in range(8 * len(data)):
            damaged = bytearray(data)
            damaged[bit // 8] ^= 1 << bit % 8
            with self.assertRaises(DatagramError):
                Datagram.from_bytes(bytes(damaged))

    def test_noise_is_refused(self) -> None:
        noise = random.Random(1)
        for length in range(200):
            data = noise.randbytes(length)
            for text in (data, b"{" + data, b'{"' + data + b'"}'):
                with self.assertRaises(DatagramError):
                    Datagram.read(text)

    def test_json_members_are_all_there_once_and_of_their_type(self) -> None:
        good = self.GOOD.to_json()
        for old, new, reason in [
            ('"throttle":0.5,', "", Reason.MEMBER),
            ('"throttle":0.5', '"throttle":0.5,"throttle":0.5', Reason.MEMBER),
            ('"throttle":0.5', '"throttle":0.5,"more":1', Reason.MEMBER),
            ('"throttle":0.5', '"throttle":"0.5"', Reason.VALUE),
            ('"throttle":0.5', '"throttle":true', Reason.VALUE),
            ('"throttle":0.5', '"throttle":NaN', Reason.RANGE),
            ('"throttle":0.5', '"throttle":1e999', Reason.RANGE),
            ('"throttle":0.5', '"throttle":1' + 400 * "0", Reason.RANGE),
            ('"throttle":0.5', '"throttle":{}', Reason.VALUE),
            ('"Demo"', '"Dream"', Reason.VALUE),
            ('"Demo"', "3", Reason.VALUE),
            ('"estop":true', '"estop":2', Reason.VALUE),
            ('"@sequence":7', '"@sequence":-7', Reason.VALUE),
            ('"@sequence":7', '"@sequence":4294967296', Reason.VALUE),
            ('"@sequence":7', '"@sequence":7.5', Reason.VALUE),
            ('"@format":1', '"@format":2', Reason.VERSION),
            ('"OperatorCommand"', '["OperatorCommand"]', Reason.KIND),
            ("{", "[", Reason.SYNTAX),
        ]:
            self.assertIn(old, good)
            self.assertIs(self.refused(good.replace(old, new, 1)), reason, f"{old} -> {new}")
        self.assertIs(self.refused("3"), Reason.SYNTAX)
        self.assertIs(self.refused("[" * 100_000), Reason.SYNTAX)

    def test_numbers_stand_for_names_and_truth_values(self) -> None:
        line = self.GOOD.to_json().replace('"Demo"', "1").replace("true", "1").replace("false", "0")
        self.assertEqual(Datagram.from_json(line), self.GOOD)

    def test_what_is_not_valid_is_not_sent(self) -> None:
        for message in (OperatorCommand(throttle=1.01), OperatorCommand(steer=math.nan), DriveCommand(-0.1),
                        DriveCommand(1e39), SafetyStatus(stalled=Components(64)), LogRecord(v=-1.0)):
            for write in (Datagram.to_bytes, Datagram.to_json):
                with self.assertRaises(DatagramError, msg=repr(message)):
                    write(Datagram(0, 0, message))
        with self.assertRaises(DatagramError):
            Datagram(1 << 32, 0, DriveCommand()).to_bytes()


class Numbers(unittest.TestCase):
    def test_the_shortest_decimal_is_the_same_single(self) -> None:
        numbers = random.Random(2)
        for _ in range(5000):
            value = struct.unpack("<f", numbers.randbytes(4))[0]
            if math.isfinite(value):
                self.assertEqual(single(decimal(value)), value)
        self.assertEqual(decimal(single(0.1)), 0.1)
        self.assertEqual(single(1e39), math.inf)
        self.assertEqual(single(-1e39), -math.inf)

    def test_the_examples_in_the_documentation_are_right(self) -> None:
        self.assertEqual(doctest.testmod(stampfly_rover).failed, 0)
