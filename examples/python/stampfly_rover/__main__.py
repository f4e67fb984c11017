"""The command line: ``python3 -m stampfly_rover drive scenarios/slalom.txt --plot terminal``."""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Callable, List, Optional

from . import engine
from .client import DEFAULT_ADDRESS, Address, ParameterRefused, RoverClient
from .messages import PARAMETERS, LogRecord
from .plot import PlotServer, TerminalPlot
from .scenario import Scenario, ScenarioError


def _address(text: str) -> Address:
    host, separator, port = text.rpartition(":")
    if not separator or not port.isdecimal():
        raise argparse.ArgumentTypeError("HOST:PORT")
    return host, int(port)


def _watcher(kind: Optional[str], stack: ExitStack) -> Callable[[LogRecord], None]:
    if kind == "terminal":
        return TerminalPlot(sys.stdout).add
    if kind == "page":
        server = stack.enter_context(PlotServer())
        print(f"plot: {server.url}", flush=True)
        return server.add
    return lambda record: None


def _drive(arguments: argparse.Namespace) -> int:
    scenario = Scenario.load(arguments.scenario)
    with ExitStack() as stack:
        watch = _watcher(arguments.plot, stack)
        rover = stack.enter_context(RoverClient(arguments.rover, use_json=arguments.json))
        outcome = scenario.run(rover, watch)
    for failure in outcome.failures:
        print(f"FAILED {failure}")
    print(f"{len(outcome.records)} lines of log, {outcome.passed} checks passed, {len(outcome.failures)} failed")
    return 1 if outcome.failures else 0


def _watch(arguments: argparse.Namespace) -> int:
    lines = 0
    with ExitStack() as stack:
        watch = _watcher(arguments.plot, stack)
        rover = stack.enter_context(RoverClient(arguments.rover, use_json=arguments.json))
        # Subscribes and sends no command, so another program can drive.
        for record in rover.drive(lambda t: None, arguments.seconds, patience=arguments.seconds):
            watch(record)
            lines += 1
    print(f"{lines} lines of log")
    return 0 if lines else 1


def _engine(arguments: argparse.Namespace) -> int:
    beats = engine.run(arguments.rover, arguments.seconds, lambda: engine.Engine(arguments.max_accel))
    print(f"{beats} heartbeats")
    return 0


def _set(arguments: argparse.Namespace) -> int:
    values = {}
    for change in arguments.changes:
        name, separator, value = change.partition("=")
        if not separator or name not in PARAMETERS:
            print(f"{change}: NAME=VALUE, with a name of {', '.join(PARAMETERS)}")
            return 2
        values[name.replace(".", "__")] = float(value)
    with RoverClient(arguments.rover, use_json=arguments.json) as rover:
        status = rover.change_parameters(**values) if values else rover.roll_back()
    print(f"version {status.version} since {status.applied_at / 1e6:.3f} s")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="stampfly-rover", description="Drive, watch and extend the simulated rover.")
    parser.add_argument("--rover", type=_address, default=DEFAULT_ADDRESS, metavar="HOST:PORT")
    parser.add_argument("--json", action="store_true", help="send JSON lines instead of bytes")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    drive = commands.add_parser("drive", help="drive a scenario; fails when one of its checks does")
    drive.add_argument("scenario", type=Path)
    drive.add_argument("--plot", choices=("terminal", "page"))
    drive.set_defaults(run=_drive)

    watch = commands.add_parser("watch", help="plot what another program drives")
    watch.add_argument("--seconds", type=float, default=60.0)
    watch.add_argument("--plot", choices=("terminal", "page"), default="terminal")
    watch.set_defaults(run=_watch)

    process = commands.add_parser("engine", help="be the rover's engine, in this process")
    process.add_argument("--max-accel", type=float, default=2.0, help="m/s^2 at full throttle")
    process.add_argument("--seconds", type=float, help="how long; until interrupted otherwise")
    process.set_defaults(run=_engine)

    change = commands.add_parser("set", help="change parameters together; without any, roll the last change back")
    change.add_argument("changes", nargs="*", metavar="NAME=VALUE")
    change.set_defaults(run=_set)
    return parser


def main(arguments: Optional[List[str]] = None) -> int:
    """Runs one command and returns the exit code."""
    parsed = _parser().parse_args(arguments)
    try:
        return int(parsed.run(parsed))
    except (ScenarioError, ParameterRefused, TimeoutError, OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
