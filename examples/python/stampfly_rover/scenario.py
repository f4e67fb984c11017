"""Scenarios: what to drive and what must be true, as lines of text.

::

    # seconds  what
    0.0  throttle 0.6            # values stay until they are changed
    2.0  throttle 0.2  steer 0.3
    3.0  check v > 2.0           # of the log: name, < <= > >= ==, value
    4.0  estop on
    5.0  check v == 0
    5.0  check system_state == EStop
    6.0  end

Times are seconds since the start, ascending. Values: ``throttle``, ``brake``, ``steer``, ``mode`` (Manual, Demo,
Replay), ``estop`` and ``reset`` (on, off). A scenario in Python is a function of the time; see ``RoverClient.drive``.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

from .client import RoverClient
from .messages import InputMode, LogRecord, OperatorCommand, SystemState

_COMPARISONS: Dict[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq,
}


class ScenarioError(ValueError):
    """A line that is no step of a scenario."""


@dataclass(frozen=True)
class Check:
    """Something that must be true of the log at a time."""

    time: float
    name: str
    comparison: str
    value: float

    def holds(self, record: LogRecord) -> bool:
        """Is it true of this line of the log?"""
        return _COMPARISONS[self.comparison](float(getattr(record, self.name)), self.value)

    def __str__(self) -> str:
        return f"t = {self.time:g} s: {self.name} {self.comparison} {self.value:g}"


@dataclass
class Outcome:
    """What came of a scenario."""

    records: List[LogRecord] = field(default_factory=list)
    failures: List[str] = field(default_factory=list)
    passed: int = 0


@dataclass(frozen=True)
class Scenario:
    """Commands by time, checks by time, and the end."""

    commands: Tuple[Tuple[float, OperatorCommand], ...]
    checks: Tuple[Check, ...]
    end: float

    @staticmethod
    def parse(text: str) -> Scenario:
        """Reads a scenario; raises :class:`ScenarioError` with the number of the line."""
        commands: List[Tuple[float, OperatorCommand]] = []
        checks: List[Check] = []
        current, last, end = OperatorCommand(), 0.0, None
        for number, line in enumerate(text.splitlines(), 1):
            words = line.split("#", 1)[0].split()
            if not words:
                continue
            try:
                time, what = float(words[0]), words[1:]
                if end is not None:
                    raise ScenarioError("something after the end")
                if not time >= last or not what:
                    raise ScenarioError("times ascend, and something happens at each")
                if what[0] == "check":
                    checks.append(_check(time, what[1:]))
                elif what == ["end"]:
                    end = time
                else:
                    current = _changed(current, what)
                    commands.append((time, current))
            except ValueError as error:
                raise ScenarioError(f"line {number}: {error}") from error
            last = time
        if end is None:
            raise ScenarioError("no end")
        return Scenario(tuple(commands), tuple(checks), end)

    @staticmethod
    def load(path: Path) -> Scenario:
        """Reads a file."""
        return Scenario.parse(path.read_text(encoding="utf-8"))

    def command(self, time: float) -> OperatorCommand:
        """The command at this time; everything released before the first."""
        command = OperatorCommand()
        for at, changed in self.commands:
            if at > time:
                break
            command = changed
        return command

    def run(self, rover: RoverClient, watch: Callable[[LogRecord], None] = lambda record: None) -> Outcome:
        """Drives the scenario by the rover's clock. A check is made on the first line of the log at or after its time.

        A check that was never reached has failed: the rover went silent.
        """
        outcome = Outcome()
        waiting = list(self.checks)
        for record in rover.drive(self.command, self.end):
            outcome.records.append(record)
            watch(record)
            now = record.t - outcome.records[0].t
            while waiting and now >= waiting[0].time:
                check = waiting.pop(0)
                if check.holds(record):
                    outcome.passed += 1
                else:
                    outcome.failures.append(f"{check}, but it is {float(getattr(record, check.name)):g}")
        outcome.failures += [f"{check}: not reached" for check in waiting]
        if not outcome.records:
            outcome.failures.append("the rover does not answer")
        return outcome


def _changed(command: OperatorCommand, words: List[str]) -> OperatorCommand:
    changes: Dict[str, Any] = {}
    for name, value in _pairs(words):
        if name in ("throttle", "brake", "steer"):
            changes[name] = float(value)
        elif name == "mode" and value in InputMode.__members__:
            changes[name] = InputMode[value]
        elif name in ("estop", "reset") and value in ("on", "off"):
            changes[name] = value == "on"
        else:
            raise ScenarioError(f"{name} {value} is no command")
    changed = replace(command, **changes)
    if not changed.is_valid():
        raise ScenarioError("a value is out of range")
    return changed


def _pairs(words: List[str]) -> Iterator[Tuple[str, str]]:
    if len(words) % 2:
        raise ScenarioError(f"{words[-1]} has no value")
    return zip(words[::2], words[1::2])


def _check(time: float, words: List[str]) -> Check:
    names = [field.name for field in fields(LogRecord)]
    if len(words) != 3 or words[0] not in names or words[1] not in _COMPARISONS:
        raise ScenarioError("a check is: name, comparison, value")
    name, comparison, text = words
    value: Optional[float] = None
    if name == "system_state" and text in SystemState.__members__:
        value = float(SystemState[text])
    return Check(time, name, comparison, float(text) if value is None else value)
