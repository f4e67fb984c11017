"""Drive, plot and extend the simulated rover of the StampFly flight stack over UDP.

Standard library only. The protocol is that of the Rust crates ``stampfly-link`` (layout) and ``stampfly-rover``
(messages); both sides are tested against one file of test vectors.

>>> from stampfly_rover import Datagram, DriveCommand
>>> Datagram.from_bytes(Datagram(1, 20_000, DriveCommand(1.5)).to_bytes()).message
DriveCommand(acceleration=1.5)
"""

from __future__ import annotations

from .client import DEFAULT_ADDRESS, RoverClient
from .datagram import Datagram, DatagramError, Reason
from .messages import (
    PARAMETERS,
    Components,
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
from .scenario import Scenario, ScenarioError

__all__ = [
    "DEFAULT_ADDRESS",
    "PARAMETERS",
    "Components",
    "Datagram",
    "DatagramError",
    "DriveCommand",
    "DriverInput",
    "InputMode",
    "LogRecord",
    "Message",
    "OperatorCommand",
    "ParameterAction",
    "ParameterRequest",
    "ParameterStatus",
    "Reason",
    "RoverClient",
    "SafetyStatus",
    "Scenario",
    "ScenarioError",
    "Subscription",
    "SystemState",
]
