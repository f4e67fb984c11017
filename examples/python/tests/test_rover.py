"""Client, scenarios, engine and command line, over UDP, against a rover in a thread."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path
from typing import List

from stampfly_rover import (
    Datagram,
    DriveCommand,
    DriverInput,
    LogRecord,
    OperatorCommand,
    RoverClient,
    SafetyStatus,
    Scenario,
    ScenarioError,
    SystemState,
    engine,
)
from stampfly_rover.__main__ import main
from stampfly_rover.client import ParameterRefused

from .simulated_rover import SimulatedRover, Vehicle, demo
from .vectors import load

FOLDER = Path(__file__).resolve().parent.parent
SCENARIOS = sorted((FOLDER / "scenarios").glob("*.txt"))


class TheSimulatedRover(unittest.TestCase):
    def test_it_is_the_documents_vehicle(self) -> None:
        vehicle, records = Vehicle(), [LogRecord()]
        for tick in range(1000):
            records.append(vehicle.tick(demo(tick * 0.01), estop=False))
        for row in load("models.json")["scenario_document_order"]["rows"]:
            record = records[round(row["t"] * 100)]
            for name in ("v", "x", "y", "yaw", "wheel_omega", "steer_angle_cmd", "drive_accel_cmd"):
                self.assertAlmostEqual(getattr(record, name), row[name], delta=1e-6, msg=f"t = {row['t']}: {name}")


class Client(unittest.TestCase):
    def test_it_drives_in_both_encodings(self) -> None:
        for use_json in (False, True):
            with SimulatedRover() as simulated, RoverClient(simulated.address, use_json=use_json) as rover:
                records = list(rover.drive(lambda t: OperatorCommand(throttle=0.5), seconds=0.6))
                self.assertGreater(len(records), 30)
                self.assertTrue(0.3 < records[-1].v < 0.7, records[-1])
                times = [record.t for record in records]
                self.assertEqual(times, sorted(set(times)))
                self.assertEqual((rover.refused, simulated.refused), (0, 0))

    def test_it_keeps_its_rate(self) -> None:
        for rate in (20.0, 100.0):
            commands = 0

            def command(t: float) -> OperatorCommand:
                nonlocal commands
                commands += 1
                return OperatorCommand()

            with SimulatedRover() as simulated, RoverClient(simulated.address, rate=rate) as rover:
                for _ in rover.drive(command, seconds=1.0):
                    pass
            self.assertTrue(0.8 * rate <= commands <= 1.2 * rate + 1, f"{commands} at {rate} Hz")

    def test_every_n_th_line_is_received(self) -> None:
        with SimulatedRover() as simulated, RoverClient(simulated.address) as rover:
            times = [record.t for record in rover.drive(lambda t: None, seconds=0.6, every=5)]
        self.assertGreater(len(times), 5)
        for before, after in zip(times, times[1:]):
            self.assertAlmostEqual(after - before, 0.05, places=4)

    def test_a_rover_that_is_not_there_is_silence_and_not_an_error(self) -> None:
        with SimulatedRover() as simulated:
            address = simulated.address
        begin = time.monotonic()
        with RoverClient(address) as rover:
            self.assertEqual(list(rover.drive(lambda t: OperatorCommand(), seconds=0.3, patience=0.3)), [])
            with self.assertRaises(TimeoutError):
                rover.roll_back(timeout=0.2)
        self.assertLess(time.monotonic() - begin, 2.0)

    def test_seconds_are_the_rovers(self) -> None:
        for speed in (0.5, 2.0):
            with SimulatedRover(speed=speed) as simulated, RoverClient(simulated.address) as rover:
                times = [record.t for record in rover.drive(lambda t: None, seconds=0.4)]
            self.assertTrue(0.4 <= times[-1] - times[0] < 0.5, (speed, times[0], times[-1]))

    def test_damaged_and_old_datagrams_are_counted_and_not_returned(self) -> None:
        with SimulatedRover() as simulated, RoverClient(simulated.address) as rover:
            self.assertIsNotNone(next(rover.drive(lambda t: None, seconds=1.0)))
            client = rover._socket.getsockname()
            simulated.socket.sendto(Datagram(0, 0, LogRecord(t=99.0)).to_bytes(), client)
            simulated.socket.sendto(b"noise", client)
            deadline = time.monotonic() + 2.0
            while rover.refused < 2 and time.monotonic() < deadline:
                message = rover.receive(0.1)
                self.assertFalse(isinstance(message, LogRecord) and message.t == 99.0)
            self.assertEqual(rover.refused, 2)

    def test_parameters_are_changed_refused_and_rolled_back(self) -> None:
        with SimulatedRover() as simulated, RoverClient(simulated.address) as rover:
            self.assertEqual(rover.change_parameters(engine__max_accel=1.0).version, 1)
            self.assertEqual(simulated.vehicle.max_accel, 1.0)
            with self.assertRaises(ParameterRefused):
                rover.change_parameters(engine__max_accel=99.0)
            self.assertEqual(simulated.vehicle.max_accel, 1.0)
            with self.assertRaises(ValueError):
                rover.change_parameters(engine__colour=1.0)
            rover.roll_back()

    def test_a_rate_of_zero_is_refused(self) -> None:
        with self.assertRaises(ValueError):
            RoverClient(rate=0.0)


class Scenarios(unittest.TestCase):
    def test_every_scenario_passes_on_the_rover(self) -> None:
        self.assertGreaterEqual(len(SCENARIOS), 4)
        for path in SCENARIOS:
            scenario = Scenario.load(path)
            self.assertGreater(len(scenario.checks), 3, path.name)
            # Faster than real time: a scenario's times are the rover's.
            with SimulatedRover(speed=2.0) as simulated, RoverClient(simulated.address, rate=100.0) as rover:
                outcome = scenario.run(rover)
            self.assertEqual((outcome.failures, outcome.passed), ([], len(scenario.checks)), path.name)

    def test_a_check_that_does_not_hold_fails(self) -> None:
        scenario = Scenario.parse("0 throttle 0.1\n0.2 check v > 2.5\n0.3 check v >= 0\n0.4 end")
        with SimulatedRover() as simulated, RoverClient(simulated.address) as rover:
            outcome = scenario.run(rover)
        self.assertEqual((outcome.passed, len(outcome.failures)), (1, 1))
        self.assertIn("v > 2.5, but it is 0.", outcome.failures[0])

    def test_a_silent_rover_fails_every_check(self) -> None:
        with SimulatedRover() as simulated:
            address = simulated.address
        with RoverClient(address) as rover:
            outcome = Scenario.parse("0 throttle 1\n0.1 check v > 0\n0.1 end").run(rover)
        self.assertEqual(len(outcome.failures), 2)

    def test_values_stay_until_they_are_changed(self) -> None:
        text = "# comment\n1 throttle 0.5 steer -1 # more\n\n2 steer 1 mode Demo\n3 estop on\n4 end\n"
        scenario = Scenario.parse(text)
        self.assertEqual(scenario.command(0.9), OperatorCommand())
        self.assertEqual((scenario.command(1.0).throttle, scenario.command(1.0).steer), (0.5, -1.0))
        self.assertEqual((scenario.command(2.5).throttle, scenario.command(2.5).steer), (0.5, 1.0))
        self.assertTrue(scenario.command(9.0).estop)
        self.assertEqual(scenario.end, 4.0)

    def test_what_is_no_scenario_is_refused_with_its_line(self) -> None:
        for text, line in [
            ("0 throttle", "line 1"), ("0 throttle 2\n1 end", "line 1"), ("0 gear 2\n1 end", "line 1"),
            ("1 throttle 1\n0 end", "line 2"), ("nan throttle 1\n1 end", "line 1"), ("0", "line 1"),
            ("0 throttle 1", "no end"), ("0 end\n1 throttle 1", "line 2"), ("0 check v 3\n1 end", "line 1"),
            ("0 check u > 3\n1 end", "line 1"), ("0 check v > fast\n1 end", "line 1"),
            ("0 estop perhaps\n1 end", "line 1"),
        ]:
            with self.assertRaises(ScenarioError, msg=text) as caught:
                Scenario.parse(text)
            self.assertIn(line, str(caught.exception), text)


class EngineComponent(unittest.TestCase):
    def hears(self, *messages: object) -> engine.Engine:
        component = engine.Engine(max_accel=2.0)
        for message in messages:
            component.hear(0.0, message)
        return component

    def test_throttle_gives_acceleration(self) -> None:
        for throttle, expected in ((0.0, 0.0), (0.25, 0.5), (1.0, 2.0)):
            component = self.hears(DriverInput(throttle=throttle), SafetyStatus())
            self.assertEqual(component.step(0.1), DriveCommand(expected))

    def test_it_idles_when_told_to_stop_and_without_input(self) -> None:
        full = DriverInput(throttle=1.0)
        for component, now in (
            (self.hears(full, SafetyStatus(estop=True)), 0.1),
            (self.hears(full, SafetyStatus(system_state=SystemState.EStop)), 0.1),
            (self.hears(full), 0.1),
            (self.hears(SafetyStatus()), 0.1),
            (self.hears(), 0.1),
            (self.hears(full, SafetyStatus()), 0.31),
        ):
            self.assertEqual(component.step(now), DriveCommand(0.0))
        self.assertEqual(self.hears(full, SafetyStatus(system_state=SystemState.Degraded)).step(0.1), DriveCommand(2.0))

    def test_a_killed_engine_process_is_an_emergency_stop(self) -> None:
        with SimulatedRover(remote_engine=True) as simulated, RoverClient(simulated.address) as rover:
            host, port = simulated.address
            command = [sys.executable, "-m", "stampfly_rover", "--rover", f"{host}:{port}", "engine"]
            process = subprocess.Popen(command, cwd=FOLDER)
            try:
                killed = 0.0
                records: List[LogRecord] = []
                for record in rover.drive(lambda t: OperatorCommand(throttle=1.0), seconds=10.0):
                    records.append(record)
                    if not killed and record.v > 0.5:
                        os.kill(process.pid, signal.SIGKILL)
                        killed = record.t
                    if record.system_state is SystemState.EStop and record.v == 0.0:
                        break
            finally:
                process.kill()
                process.wait()
        stopped = next(record.t for record in records if record.system_state is SystemState.EStop)
        self.assertTrue(killed > 0.0 and records[-1].v == 0.0)
        self.assertLess(stopped - killed, 0.4)


class CommandLine(unittest.TestCase):
    def run_main(self, simulated: SimulatedRover, *arguments: str) -> "tuple[int, str]":
        host, port = simulated.address
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = main(["--rover", f"{host}:{port}", *arguments])
        return code, out.getvalue()

    def test_drive_returns_whether_the_checks_held(self) -> None:
        with SimulatedRover() as simulated:
            code, out = self.run_main(simulated, "drive", str(FOLDER / "scenarios" / "launch.txt"), "--plot", "page")
            self.assertEqual(code, 0, out)
            self.assertIn("plot: http://127.0.0.1:", out)
            self.assertIn("0 failed", out)
        with SimulatedRover() as simulated:
            simulated.state = SystemState.EStop
            code, out = self.run_main(simulated, "drive", str(FOLDER / "scenarios" / "launch.txt"))
            self.assertEqual(code, 1, out)

    def test_watch_set_and_engine(self) -> None:
        with SimulatedRover() as simulated:
            code, out = self.run_main(simulated, "watch", "--seconds", "0.4")
            self.assertEqual(code, 0)
            self.assertIn("throttle", out)
            code, out = self.run_main(simulated, "set", "engine.max_accel=1.5")
            self.assertEqual((code, simulated.vehicle.max_accel), (0, 1.5), out)
            self.assertEqual(self.run_main(simulated, "set", "engine.colour=3")[0], 2)
            with contextlib.redirect_stderr(io.StringIO()):
                self.assertEqual(self.run_main(simulated, "set", "engine.max_accel=99")[0], 2)
            self.assertEqual(self.run_main(simulated, "engine", "--seconds", "0.2")[0], 0)

    def test_the_python_scenario_measures_the_lag(self) -> None:
        with SimulatedRover() as simulated:
            host, port = simulated.address
            script = str(FOLDER / "scenarios" / "sine_steering.py")
            command = [sys.executable, script, f"{host}:{port}"]
            out = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
        lines = out.stdout.splitlines()
        self.assertEqual(len(lines), 4)
        for line in lines[:3]:
            words = line.split()
            self.assertAlmostEqual(float(words[2]), float(words[-2]), delta=0.015, msg=line)
