"""Datagrams: one message as little-endian bytes with a checksum, or as one line of JSON.

===========  ======  ======================================================================
offset       type    field
===========  ======  ======================================================================
0            4 x u8  magic ``RVR1``
4            u8      version of the format, 1
5            u8      kind of the message
6            u16     length of the message, bytes
8            u32     sequence number of the sender, wraps
12           u64     time of the sender, microseconds since its start
20                   the fields of the message in order: 4 bytes each, 8 for a time
end          u32     CRC-32 (zlib) of everything before
===========  ======  ======================================================================

A datagram is valid as a whole or refused: length, checksum, every number finite and in its range. It is not
authenticated: keep the sockets on the loopback interface or a network of your own.
"""

from __future__ import annotations

import json
import math
import struct
import zlib
from dataclasses import dataclass
from enum import Enum, IntEnum, IntFlag
from typing import Any, Dict, List, Tuple, Type, Union, cast

from .messages import KINDS, Message, Micros, Wire

MAGIC = b"RVR1"
FORMAT = 1
_HEADER = struct.Struct("<4sBBHIQ")
_CHECKSUM = struct.Struct("<I")
_U32 = 1 << 32
_U64 = 1 << 64


class Reason(Enum):
    """Why something is no datagram."""

    LENGTH = "Length"
    MAGIC = "Magic"
    VERSION = "Version"
    KIND = "Kind"
    CHECKSUM = "Checksum"
    SYNTAX = "Syntax"
    MEMBER = "Member"
    VALUE = "Value"
    RANGE = "Range"


class DatagramError(ValueError):
    """Not a datagram. Nothing of it may be used."""

    def __init__(self, reason: Reason, detail: str = "") -> None:
        super().__init__(f"{reason.value}: {detail}" if detail else reason.value)
        self.reason = reason


def _code(wire: Wire) -> str:
    return "f" if wire is float else "Q" if wire is Micros else "I"


def _layout(message: Type[Message]) -> struct.Struct:
    return struct.Struct("<" + "".join(_code(wire) for _, wire in message.FIELDS))


_LAYOUTS = {kind: _layout(message) for kind, message in KINDS.items()}
_NAMES = {message.__name__: kind for kind, message in KINDS.items()}


def single(value: float) -> float:
    """The nearest IEEE 754 single."""
    try:
        return cast(float, struct.unpack("<f", struct.pack("<f", float(value)))[0])
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def decimal(value: float) -> float:
    """The number with the fewest digits that is the same single, so that JSON stays readable."""
    for digits in range(1, 10):
        short = float(f"{value:.{digits}g}")
        if single(short) == single(value):
            return short
    return value


def _from_wire(wire: Wire, value: Any) -> Any:
    """A field's value from a number or, in JSON, a name or a truth value."""
    if wire is float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise DatagramError(Reason.VALUE, repr(value))
        return single(value)
    if isinstance(wire, type) and issubclass(wire, IntEnum) and isinstance(value, str):
        try:
            return wire[value]
        except KeyError as error:
            raise DatagramError(Reason.VALUE, value) from error
    if wire is bool and isinstance(value, bool):
        return value
    if isinstance(value, bool) or not isinstance(value, int):
        raise DatagramError(Reason.VALUE, repr(value))
    if not 0 <= value < (_U64 if wire is Micros else _U32):
        raise DatagramError(Reason.VALUE, repr(value))
    if wire is bool and value > 1:
        raise DatagramError(Reason.VALUE, repr(value))
    if issubclass(wire, IntFlag) and value & ~sum(wire):
        raise DatagramError(Reason.VALUE, repr(value))
    try:
        return wire(value)
    except ValueError as error:
        raise DatagramError(Reason.VALUE, repr(value)) from error


def _make(kind: int, values: Dict[str, Any]) -> Message:
    message = KINDS[kind]
    made = message(**{name: _from_wire(wire, values[name]) for name, wire in message.FIELDS})
    if not made.is_valid():
        raise DatagramError(Reason.RANGE, repr(made))
    return made


def _unique(pairs: List[Tuple[str, Any]]) -> Dict[str, Any]:
    members = dict(pairs)
    if len(members) != len(pairs):
        raise DatagramError(Reason.MEMBER, "twice")
    return members


@dataclass(frozen=True)
class Datagram:
    """One message with the sender's sequence number and time (microseconds since its start)."""

    sequence: int
    time: int
    message: Message

    def to_bytes(self) -> bytes:
        """The datagram as bytes.

        Raises :class:`DatagramError` when a value is not finite or out of range: what must not be used is not sent.
        """
        self._check()
        message = self.message
        body = _LAYOUTS[message.KIND].pack(*(getattr(message, name) for name, _ in message.FIELDS))
        header = _HEADER.pack(MAGIC, FORMAT, message.KIND, len(body), self.sequence, self.time)
        return header + body + _CHECKSUM.pack(zlib.crc32(header + body))

    def to_json(self) -> str:
        """The datagram as one line of JSON, without its line feed."""
        self._check()
        message = self.message
        members: Dict[str, Any] = {
            "@kind": type(message).__name__, "@format": FORMAT, "@sequence": self.sequence, "@time": self.time,
        }
        for name, wire in message.FIELDS:
            value = getattr(message, name)
            if wire is float:
                members[name] = decimal(value)
            elif issubclass(wire, IntEnum):
                members[name] = wire(value).name
            else:
                members[name] = bool(value) if wire is bool else int(value)
        return json.dumps(members, separators=(",", ":"))

    def _check(self) -> None:
        # The values as they will be read: singles, and numbers that fit.
        message = self.message
        _make(message.KIND, {name: getattr(message, name) for name, _ in message.FIELDS})
        if not (0 <= self.sequence < _U32 and 0 <= self.time < _U64):
            raise DatagramError(Reason.RANGE, "sequence or time")

    @staticmethod
    def from_bytes(data: bytes) -> Datagram:
        """Reads a datagram; raises :class:`DatagramError` when it is none."""
        if len(data) < _HEADER.size + _CHECKSUM.size:
            raise DatagramError(Reason.LENGTH)
        rest, (checksum,) = data[:-_CHECKSUM.size], _CHECKSUM.unpack(data[-_CHECKSUM.size:])
        magic, version, kind, length, sequence, time = _HEADER.unpack(rest[: _HEADER.size])
        body = rest[_HEADER.size:]
        if magic != MAGIC:
            raise DatagramError(Reason.MAGIC)
        if version != FORMAT:
            raise DatagramError(Reason.VERSION)
        if len(body) != length:
            raise DatagramError(Reason.LENGTH)
        if zlib.crc32(rest) != checksum:
            raise DatagramError(Reason.CHECKSUM)
        if kind not in KINDS:
            raise DatagramError(Reason.KIND)
        if length != _LAYOUTS[kind].size:
            raise DatagramError(Reason.LENGTH)
        names = [name for name, _ in KINDS[kind].FIELDS]
        return Datagram(sequence, time, _make(kind, dict(zip(names, _LAYOUTS[kind].unpack(body)))))

    @staticmethod
    def from_json(line: Union[str, bytes]) -> Datagram:
        """Reads one line of JSON; raises :class:`DatagramError` when it is no datagram."""
        try:
            members = json.loads(line, object_pairs_hook=_unique)
        except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
            raise DatagramError(Reason.SYNTAX) from error
        if not isinstance(members, dict) or not members:
            raise DatagramError(Reason.SYNTAX)
        try:
            name, version, sequence, time = (members.pop(f"@{name}") for name in ("kind", "format", "sequence", "time"))
        except KeyError as error:
            raise DatagramError(Reason.MEMBER, str(error)) from error
        if version != FORMAT:
            raise DatagramError(Reason.VERSION)
        if not isinstance(name, str) or name not in _NAMES:
            raise DatagramError(Reason.KIND)
        kind = _NAMES[name]
        if set(members) != {field for field, _ in KINDS[kind].FIELDS}:
            raise DatagramError(Reason.MEMBER)
        return Datagram(_from_wire(int, sequence), int(_from_wire(Micros, time)), _make(kind, members))

    @staticmethod
    def read(data: bytes) -> Datagram:
        """Reads either form: JSON begins with a brace, bytes with the magic."""
        return Datagram.from_json(data) if data.lstrip()[:1] == b"{" else Datagram.from_bytes(data)
