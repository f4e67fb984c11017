"""The rover's engine in a process of its own: driver's input in, acceleration out, over UDP.

It is the Engine component of the vehicle, replaced without touching the vehicle. Every 10 ms it sends a
``DriveCommand``, which is its heartbeat. From the first one on the rover's own engine is silent; when the process dies the
safety supervisor stops the vehicle within the heartbeat's limit::

    python3 -m stampfly_rover engine --max-accel 2.0
"""

from __future__ import annotations

import time
from typing import Callable, Optional

from .client import DEFAULT_ADDRESS, Address, RoverClient
from .messages import DriveCommand, DriverInput, SafetyStatus

#: Seconds between two heartbeats: the engine's period in the rover.
PERIOD = 0.01

#: Seconds without input from the rover after which the engine idles. The rover's own watchdog has the same limit.
SILENCE = 0.3


class Engine:
    """The component: the rover's newest input and the supervisor's newest decision give an acceleration, m/s^2."""

    def __init__(self, max_accel: float = 2.0) -> None:
        self.max_accel = max_accel
        self._input: Optional[DriverInput] = None
        self._status: Optional[SafetyStatus] = None
        self._heard = -SILENCE

    def hear(self, now: float, message: object) -> None:
        """Takes note of a message from the rover, received at ``now`` (seconds)."""
        if isinstance(message, DriverInput):
            self._input = message
        elif isinstance(message, SafetyStatus):
            self._status = message
        else:
            return
        self._heard = now

    def step(self, now: float) -> DriveCommand:
        """The command at ``now``: no acceleration in an emergency stop, without input, or before the first of both."""
        silent = now - self._heard > SILENCE
        if silent or self._input is None or self._status is None or self._status.must_stop:
            return DriveCommand(0.0)
        return DriveCommand(min(max(self._input.throttle, 0.0), 1.0) * self.max_accel)


def run(
    address: Address = DEFAULT_ADDRESS,
    seconds: Optional[float] = None,
    make_engine: Callable[[], Engine] = Engine,
) -> int:
    """Runs the engine for ``seconds``, or until it is interrupted. Returns the number of heartbeats sent."""
    engine, beats = make_engine(), 0
    with RoverClient(address) as rover:
        begin = beat = time.monotonic()
        while seconds is None or beat - begin < seconds:
            # The first command also tells the rover where its engine is.
            rover.send(engine.step(time.monotonic()))
            beats += 1
            # A process that was stopped for a while does not send what it missed.
            beat = max(beat + PERIOD, time.monotonic())
            while (remaining := beat - time.monotonic()) > 0.0:
                message = rover.receive(remaining)
                if message is not None:
                    engine.hear(time.monotonic(), message)
    return beats
