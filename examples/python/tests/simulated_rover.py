"""A rover for these tests: the document's models and the protocol, in a thread, on a port of its own.

The real one is Rust. This one lets the package be tested by itself; it is tested against the same reference values, and
has as much of a supervisor as the tests need.
"""

from __future__ import annotations

import math
import socket
import threading
import time
from dataclasses import replace
from typing import Dict, Optional, Tuple

from stampfly_rover import (
    Datagram,
    DatagramError,
    DriveCommand,
    DriverInput,
    InputMode,
    LogRecord,
    Message,
    OperatorCommand,
    ParameterAction,
    ParameterRequest,
    ParameterStatus,
    SafetyStatus,
    Subscription,
    SystemState,
)
from stampfly_rover.messages import Micros

Address = Tuple[str, int]
DT = 0.01
#: Heartbeat limit of an engine in another process, s.
LIMIT = 0.3


def demo(t: float) -> DriverInput:
    """The built-in scenario."""
    if t < 1.999999:
        return DriverInput(throttle=0.6)
    if t < 4.999999:
        return DriverInput(throttle=0.2, steer=0.2)
    return DriverInput(brake=0.6) if t < 6.999999 else DriverInput()


class Vehicle:
    """The models: one tick of 10 ms after the other."""

    def __init__(self) -> None:
        self.record = LogRecord()
        self.max_accel = 2.0

    def tick(self, wanted: DriverInput, estop: bool, drive: Optional[float] = None) -> LogRecord:
        old = self.record
        accel = 0.0 if estop else wanted.throttle * self.max_accel if drive is None else drive
        decel = 4.0 if estop else wanted.brake * 4.0
        target = 0.0 if estop else wanted.steer * 0.4
        angle = old.steer_angle_cmd + (1.0 - math.exp(-DT / 0.15)) * (target - old.steer_angle_cmd)
        v = min(max(old.v + (accel - decel - (6.0 if estop else 0.0)) * DT, 0.0), 3.0)
        yaw_rate = v / 0.2 * math.tan(angle)
        yaw = old.yaw + yaw_rate * DT
        self.record = replace(
            old, t=old.t + DT, throttle=wanted.throttle, brake=wanted.brake, steer=wanted.steer, drive_accel_cmd=accel,
            brake_decel_cmd=decel, steer_angle_cmd=angle, v=v, wheel_omega=v / 0.03, yaw_rate=yaw_rate, yaw=yaw,
            x=old.x + v * math.cos(yaw) * DT, y=old.y + v * math.sin(yaw) * DT,
        )
        return self.record


class SimulatedRover:
    """Runs a vehicle behind a UDP socket. ``speed`` times as fast as real time."""

    def __init__(self, speed: float = 1.0, remote_engine: bool = False) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.001)
        self.address: Address = self.socket.getsockname()
        self.vehicle = Vehicle()
        self.state = SystemState.Normal
        self.operator = OperatorCommand()
        self.refused = 0
        self.drops = 0
        self._speed, self._remote = speed, remote_engine
        self._reset = False
        self._demo_since: Optional[float] = None
        self._status = ParameterStatus()
        self._candidate = self._previous = self.vehicle.max_accel
        self._subscribers: Dict[Address, Tuple[float, int, bool]] = {}
        self._engine: Optional[Tuple[Address, float, float]] = None
        self._sequence = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> SimulatedRover:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self.socket.close()

    def _run(self) -> None:
        due, tick = time.monotonic(), 0
        while not self._stop.is_set():
            if time.monotonic() < due:
                try:
                    data, sender = self.socket.recvfrom(2048)
                except (socket.timeout, TimeoutError, ConnectionRefusedError):
                    continue
                try:
                    self._hear(Datagram.read(data).message, sender, data[:1] == b"{")
                except DatagramError:
                    self.refused += 1
                continue
            due += DT / self._speed
            tick += 1
            self._tick(tick)

    def _hear(self, message: Message, sender: Address, as_json: bool) -> None:
        if isinstance(message, OperatorCommand):
            self.operator = message
        elif isinstance(message, Subscription):
            self._subscribers[sender] = (time.monotonic() + 2.0, message.every, as_json)
        elif isinstance(message, DriveCommand):
            self._engine = (sender, time.monotonic(), message.acceleration)
        elif isinstance(message, ParameterRequest):
            self._change(message)

    def _change(self, request: ParameterRequest) -> None:
        if request.action is ParameterAction.Set:
            if request.index == 0 and 0.1 <= request.value <= 10.0:
                self._candidate = request.value
            else:
                self._status = replace(self._status, refused=self._status.refused + 1)
            return
        if request.action is ParameterAction.RollBack:
            self._candidate = self._previous
        self._previous, self.vehicle.max_accel = self.vehicle.max_accel, self._candidate
        applied = Micros(int(self.vehicle.record.t * 1e6))
        self._status = replace(self._status, version=self._status.version + 1, applied_at=applied)

    def _tick(self, tick: int) -> None:
        asked, t = self.operator, self.vehicle.record.t
        engine = self._engine
        lost = self._remote and engine is not None and time.monotonic() - engine[1] > LIMIT
        if asked.estop or lost:
            self.state = SystemState.EStop
        elif asked.reset and not self._reset:
            self.state = SystemState.Normal
        self._reset = asked.reset
        wanted = DriverInput(asked.throttle, asked.brake, asked.steer)
        if asked.mode is InputMode.Demo:
            self._demo_since = t if self._demo_since is None else self._demo_since
            wanted = demo(t - self._demo_since)
        status = SafetyStatus(asked.estop, self.state)
        drive = None if not self._remote else 0.0 if engine is None else engine[2]
        record = self.vehicle.tick(wanted, status.must_stop, drive)
        record = replace(record, estop=asked.estop, system_state=self.state)
        now = time.monotonic()
        for address, (until, every, as_json) in list(self._subscribers.items()):
            if now > until:
                del self._subscribers[address]
            elif every and tick % every == 0:
                self._send(record, address, as_json)
                if tick % 10 == 0:
                    self._send(self._status, address, as_json)
        if self._remote and engine is not None:
            self._send(wanted, engine[0], False)
            self._send(status, engine[0], False)

    def _send(self, message: Message, address: Address, as_json: bool) -> None:
        datagram = Datagram(self._sequence, int(self.vehicle.record.t * 1e6), message)
        self._sequence += 1
        self.socket.sendto(datagram.to_json().encode() if as_json else datagram.to_bytes(), address)
