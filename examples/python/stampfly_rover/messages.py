"""The messages of the rover, as in the Rust module ``stampfly_rover::messages``.

Units are SI, angles in radians. Frame: x forward at the start, y left, yaw counter-clockwise positive, so positive
steering turns left. Numbers travel as IEEE 754 singles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import ClassVar, Dict, Tuple, Type, Union


class InputMode(IntEnum):
    """Where the driver's input comes from."""

    Manual = 0
    Demo = 1
    Replay = 2


class SystemState(IntEnum):
    """State of the safety supervisor, in order of severity."""

    Normal = 0
    Degraded = 1
    EStop = 2


class ParameterAction(IntEnum):
    """What to do with the parameters."""

    Set = 0
    Apply = 1
    RollBack = 2


class Components(IntFlag):
    """The components whose heartbeat is supervised."""

    ENGINE = 1
    BRAKE = 2
    STEERING = 4
    DYNAMICS = 8
    COM = 16
    TIME_BASE = 32


#: How a field travels: ``float`` as f32, ``int`` as u32, ``bool`` and enumerations as u32.
Wire = Union[Type[float], Type[int], Type[bool], Type[IntEnum], Type[IntFlag], Type["Micros"]]
Fields = Tuple[Tuple[str, Wire], ...]


class Micros(int):
    """Microseconds since the sender's start; travels as u64."""


def _is_input(throttle: float, brake: float, steer: float) -> bool:
    return 0.0 <= throttle <= 1.0 and 0.0 <= brake <= 1.0 and -1.0 <= steer <= 1.0


class _Message:
    """What all messages have: a kind, fields in wire order, and a check of their ranges."""

    KIND: ClassVar[int]
    FIELDS: ClassVar[Fields]

    def in_range(self) -> bool:
        """Are the values in the ranges the protocol allows? Finiteness is checked apart."""
        return True

    def is_valid(self) -> bool:
        """May the message be sent and used?"""
        numbers = (getattr(self, name) for name, wire in self.FIELDS if wire is float)
        return all(math.isfinite(number) for number in numbers) and self.in_range()


@dataclass(frozen=True)
class OperatorCommand(_Message):
    """To the rover: what the operator asks for. A reset acts when it changes from false to true."""

    throttle: float = 0.0
    brake: float = 0.0
    steer: float = 0.0
    mode: InputMode = InputMode.Manual
    estop: bool = False
    reset: bool = False

    KIND: ClassVar[int] = 1
    FIELDS: ClassVar[Fields] = (
        ("throttle", float), ("brake", float), ("steer", float),
        ("mode", InputMode), ("estop", bool), ("reset", bool),
    )

    def in_range(self) -> bool:
        return _is_input(self.throttle, self.brake, self.steer)


@dataclass(frozen=True)
class ParameterRequest(_Message):
    """To the rover: one step of a change of parameters. ``index`` is the place in :data:`PARAMETERS`."""

    action: ParameterAction = ParameterAction.Set
    index: int = 0
    value: float = 0.0

    KIND: ClassVar[int] = 2
    FIELDS: ClassVar[Fields] = (("action", ParameterAction), ("index", int), ("value", float))


@dataclass(frozen=True)
class DriveCommand(_Message):
    """To the rover, from an engine in another process: acceleration, m/s^2. Each one is its heartbeat."""

    acceleration: float = 0.0

    KIND: ClassVar[int] = 3
    FIELDS: ClassVar[Fields] = (("acceleration", float),)

    def in_range(self) -> bool:
        return self.acceleration >= 0.0


@dataclass(frozen=True)
class DriverInput(_Message):
    """From the rover: the selected and limited input."""

    throttle: float = 0.0
    brake: float = 0.0
    steer: float = 0.0

    KIND: ClassVar[int] = 4
    FIELDS: ClassVar[Fields] = (("throttle", float), ("brake", float), ("steer", float))

    def in_range(self) -> bool:
        return _is_input(self.throttle, self.brake, self.steer)


@dataclass(frozen=True)
class SafetyStatus(_Message):
    """From the rover: what the safety supervisor has decided."""

    estop: bool = False
    system_state: SystemState = SystemState.Normal
    stalled: Components = Components(0)

    KIND: ClassVar[int] = 5
    FIELDS: ClassVar[Fields] = (("estop", bool), ("system_state", SystemState), ("stalled", Components))

    @property
    def must_stop(self) -> bool:
        """Must every component stop?"""
        return self.estop or self.system_state is SystemState.EStop


@dataclass(frozen=True)
class LogRecord(_Message):
    """From the rover: one line of the log."""

    t: float = 0.0
    throttle: float = 0.0
    brake: float = 0.0
    steer: float = 0.0
    drive_accel_cmd: float = 0.0
    brake_decel_cmd: float = 0.0
    steer_angle_cmd: float = 0.0
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    v: float = 0.0
    yaw_rate: float = 0.0
    wheel_omega: float = 0.0
    estop: bool = False
    system_state: SystemState = SystemState.Normal

    KIND: ClassVar[int] = 6
    FIELDS: ClassVar[Fields] = (
        ("t", float), ("throttle", float), ("brake", float), ("steer", float), ("drive_accel_cmd", float),
        ("brake_decel_cmd", float), ("steer_angle_cmd", float), ("x", float), ("y", float), ("yaw", float),
        ("v", float), ("yaw_rate", float), ("wheel_omega", float), ("estop", bool), ("system_state", SystemState),
    )

    def in_range(self) -> bool:
        return _is_input(self.throttle, self.brake, self.steer) and self.v >= 0.0


@dataclass(frozen=True)
class ParameterStatus(_Message):
    """From the rover: which parameters are in use."""

    version: int = 0
    applied_at: Micros = Micros(0)
    refused: int = 0

    KIND: ClassVar[int] = 7
    FIELDS: ClassVar[Fields] = (("version", int), ("applied_at", Micros), ("refused", int))


@dataclass(frozen=True)
class Subscription(_Message):
    """To the rover: send me every n-th line of the log. Lapses after two seconds; 0 ends it."""

    every: int = 1

    KIND: ClassVar[int] = 8
    FIELDS: ClassVar[Fields] = (("every", int),)


Message = Union[
    OperatorCommand, ParameterRequest, DriveCommand, DriverInput, SafetyStatus, LogRecord, ParameterStatus, Subscription
]

#: Every message by its kind.
KINDS: Dict[int, Type[Message]] = {
    message.KIND: message
    for message in (
        OperatorCommand, ParameterRequest, DriveCommand, DriverInput,
        SafetyStatus, LogRecord, ParameterStatus, Subscription,
    )
}

#: Names of the parameters; the place is the number in a :class:`ParameterRequest`.
PARAMETERS: Tuple[str, ...] = (
    "engine.max_accel",
    "brake.max_decel",
    "brake.estop_max_decel",
    "steering.max_angle",
    "steering.time_constant",
    "vehicle.wheel_radius",
    "vehicle.wheelbase",
    "vehicle.linear_drag",
    "vehicle.max_speed",
    "vehicle.estop_decel",
    "input.timeout",
    "input.degraded_speed",
    "input.degraded_band",
    "input.degraded_steer",
    "safety.engine_timeout",
    "safety.brake_timeout",
    "safety.steering_timeout",
    "safety.dynamics_timeout",
    "safety.com_timeout",
    "safety.time_base_timeout",
    "safety.watchdog",
)
