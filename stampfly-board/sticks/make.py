#!/usr/bin/env python3
"""Writes the stick files of this folder: what hard, tired and careless thumbs do to a vehicle. `python3 make.py` writes all of them again.

A file that begins armed with the throttle raised begins in a hover, at the height of `--from-height`. One that begins disarmed has the
vehicle's time from power-on; it may be armed some seconds after that.
"""

import math
import pathlib
import random

HERE = pathlib.Path(__file__).parent
HOVER = 0.6  # The throttle that carries a StampFly in STABILIZE and ACRO.
READY = 8.0  # From here on a vehicle may be armed, s after power-on.
STEP = 0.02  # Between two frames of a transmitter, s.


class Sticks:
    """Rows of a file. Each call moves some sticks and switches, and leaves them so for some seconds."""

    def __init__(self, mode, arm=1, throttle=None):
        throttle = (HOVER if mode in ("stabilize", "acro") else 0.0) if throttle is None else throttle
        self.t, self.rows = 0.0, []
        self.now = dict(throttle=throttle, roll=0.0, pitch=0.0, yaw=0.0, mode=mode, arm=arm, flip=0, kill=0, land=0)

    def hold(self, seconds, **moves):
        self.now.update(moves)
        self.rows.append((self.t, dict(self.now)))
        self.t += seconds
        return self

    def centre(self, seconds, **moves):
        return self.hold(seconds, roll=0.0, pitch=0.0, yaw=0.0, **moves)

    def recover(self, seconds=4.0):
        """What a person does who has had enough: ALT_HOLD, and hands off."""
        return self.centre(seconds, mode="althold", throttle=0.0)

    def write(self, name):
        rows = self.rows + [(self.t, self.rows[-1][1])]
        switches = [s for s in ("flip", "kill", "land") if any(row[s] for _, row in rows)]
        names = ["throttle", "roll", "pitch", "yaw", "mode", "arm", *switches]
        number = lambda value: value if isinstance(value, str) else f"{value:.3f}".rstrip("0").rstrip(".")
        lines = [",".join(["t", *names])]
        lines += [",".join([number(t), *(number(row[name]) for name in names)]) for t, row in rows]
        (HERE / f"{name}.csv").write_text("\n".join(lines).replace("-0,", "0,") + "\n")


def from_ground(mode):
    """Disarmed, with the throttle at rest, until the vehicle may be armed; then armed."""
    rest = -1.0 if mode in ("stabilize", "acro") else 0.0
    return Sticks(mode, arm=0, throttle=rest).hold(READY).hold(1.0, arm=1)


MANUAL = ("stabilize", "acro")
HOLDING = ("althold", "poshold")

# Throttle chops out of a hover, caught with full throttle for as long.
for mode in MANUAL:
    for seconds in (0.3, 0.9, 2.0):
        chop = Sticks(mode).hold(0.5).hold(seconds, throttle=-1.0).hold(seconds, throttle=1.0)
        chop.recover().write(f"chop-{mode}-{seconds}s")
# A thumb that lets the vehicle sink on a tenth of the thrust.
for seconds in (0.8, 1.5, 3.0):
    idle = Sticks("stabilize").hold(0.5).hold(seconds, throttle=0.1).hold(1.0, throttle=1.0)
    idle.recover().write(f"idle-{seconds}s")
# Pumping: full and nothing in turn.
pump = Sticks("stabilize").hold(0.5)
for _ in range(12):
    pump.hold(0.25, throttle=1.0).hold(0.25, throttle=-1.0)
pump.hold(0.5, throttle=1.0).recover().write("pump")

# Punch-outs, from a hover and from the ground.
for seconds in (0.5, 1.0, 2.0):
    punch = Sticks("stabilize").hold(0.5).hold(seconds, throttle=1.0).hold(0.8, throttle=0.3)
    punch.hold(0.6, throttle=0.9).recover().write(f"punch-{seconds}s")
for seconds, chop in ((1.0, 0.4), (1.3, 0.7), (1.6, 1.0), (2.0, 1.5)):
    up = from_ground("stabilize").hold(seconds, throttle=1.0).hold(chop, throttle=-1.0)
    up.hold(0.8, throttle=1.0).recover(6.0).write(f"punch-ground-{seconds}s-chop-{chop}s")
from_ground("acro").hold(1.2, throttle=1.0).hold(0.8, throttle=0.3).recover(6.0).write("punch-ground-acro")

# Flips by hand: up, full stick without thrust, level in STABILIZE with full throttle.
for name, stick in {"right": dict(roll=1.0), "left": dict(roll=-1.0), "front": dict(pitch=1.0), "back": dict(pitch=-1.0)}.items():
    for seconds in (0.62, 1.45):
        flip = Sticks("stabilize").hold(0.5).hold(0.25, mode="acro", throttle=0.9)
        flip.hold(seconds, throttle=0.05, **stick).centre(1.0, mode="stabilize", throttle=1.0)
        flip.recover().write(f"flip-{name}-{seconds}s")
    turned = Sticks("poshold", throttle=0.0).hold(1.0).hold(0.1, flip=1, **stick).centre(4.0, flip=0)
    turned.recover(2.0).write(f"flip-column-{name}")

# Dives: the nose down at full stick, and pulled out.
for mode in (*MANUAL, *HOLDING):
    dive = Sticks(mode).hold(0.5).hold(0.4 if mode == "acro" else 2.0, pitch=1.0)
    dive.hold(0.3, pitch=0.0).hold(0.4 if mode == "acro" else 1.0, pitch=-1.0).centre(0.5)
    dive.recover().write(f"dive-{mode}")
dive = Sticks("acro").hold(0.5).hold(0.39, pitch=1.0, throttle=0.2).hold(0.3, pitch=0.0, throttle=0.0)
dive.centre(1.2, mode="stabilize", throttle=1.0).recover().write("dive-steep")

# Spins at full yaw, alone and with a lean.
for name, stick in {"right": dict(yaw=1.0), "left": dict(yaw=-1.0), "lean": dict(yaw=1.0, pitch=0.5)}.items():
    Sticks("stabilize").hold(0.5).hold(4.0, **stick).centre(1.5).write(f"spin-{name}")

# Sticks against each other, to the other stop again and again.
for period in (0.06, 0.12, 0.25, 0.6):
    for name, axes in {"roll-pitch-yaw": (1, -1, 1, 0), "all": (1, -1, 1, -0.6)}.items():
        roll, pitch, yaw, throttle = axes
        other = Sticks("poshold").hold(0.5)
        for turn in range(int(8.0 / period)):
            sign = (-1) ** turn
            other.hold(period, roll=sign * roll, pitch=sign * pitch, yaw=sign * yaw, throttle=sign * throttle)
        other.centre(2.0, throttle=0.0).write(f"opposite-{name}-{period}s")

# At the stops: every corner of both sticks.
for mode in (*MANUAL, *HOLDING):
    stops = Sticks(mode).hold(0.5)
    for corner in range(16):
        bits = [1.0 if corner >> bit & 1 else -1.0 for bit in range(4)]
        level = stops.now["throttle"] if mode in MANUAL else bits[3]
        stops.hold(0.4, roll=bits[0], pitch=bits[1], yaw=bits[2], throttle=level).centre(0.4)
    stops.recover().write(f"stops-{mode}")
for name, stick in {"up": dict(throttle=1.0), "down": dict(throttle=-1.0), "right": dict(roll=1.0), "back": dict(pitch=-1.0)}.items():
    Sticks("poshold").hold(0.5).hold(6.0, **stick).centre(2.0, throttle=0.0).write(f"stop-{name}")

# The mode is changed at every moment.
CYCLE = ("stabilize", "althold", "acro", "poshold")


def cycle(sticks, seconds, period, moves=lambda mode: {}):
    for turn in range(int(seconds / period)):
        mode = CYCLE[turn % 4]
        throttle = HOVER if mode in MANUAL else 0.0
        sticks.hold(period, **{"mode": mode, "throttle": throttle, **moves(mode)})
    return sticks


for period in (0.1, 0.3, 0.7):
    cycle(Sticks("poshold").hold(0.5), 6.0, period).recover().write(f"modes-hover-{period}s")
    cycle(Sticks("poshold").hold(0.5), 4.0, period, lambda mode: dict(throttle=0.9)).recover().write(f"modes-climb-{period}s")
    down = lambda mode: dict(throttle=0.45 if mode in MANUAL else -0.8)
    cycle(Sticks("poshold").hold(0.5), 3.0, period, down).recover().write(f"modes-descent-{period}s")
    lean = lambda mode: dict(roll=0.7, pitch=0.5)
    cycle(Sticks("poshold").hold(0.5), 4.0, period, lean).recover().write(f"modes-lean-{period}s")
for first in HOLDING:
    for second in (mode for mode in CYCLE if mode != first):
        for after in (0.4, 1.5):
            rest = HOVER if second in MANUAL else 0.0
            up = Sticks(first, arm=0).hold(READY).hold(after, arm=1).hold(3.0, mode=second, throttle=rest)
            up.recover(6.0).write(f"modes-take-off-{first}-{second}-{after}s")
        # A landing begins, and the mode is changed on the way down.
        rest = HOVER if second in MANUAL else 0.0
        land = Sticks(first).hold(0.5).hold(1.0, arm=0).hold(1.0, mode=second, throttle=rest).hold(8.0, mode=first, throttle=0.0)
        land.write(f"modes-landing-{first}-{second}")
for caught in HOLDING:
    for seconds in (0.3, 0.6, 0.9):
        chop = Sticks("stabilize").hold(0.5).hold(seconds, throttle=-1.0).hold(4.0, mode=caught, throttle=0.0)
        chop.write(f"modes-chop-{caught}-{seconds}s")
# Out of a hold with the sprung stick in its centre, or at its lowest.
for mode in MANUAL:
    for name, throttle in (("centre", 0.0), ("lowest", -1.0)):
        switch = Sticks("poshold").hold(1.0).hold(2.0, mode=mode, throttle=throttle)
        switch.recover().write(f"modes-to-{mode}-{name}")

# Tired thumbs: slow drifts, noise about the dead zone, a hand that trembles.
tired = random.Random(1)
drift = Sticks("poshold")
for frame in range(1500):
    t = frame * STEP
    wave = lambda period, size, phase: size * math.sin(2 * math.pi * t / period + phase)
    drift.hold(STEP, roll=wave(11, 0.2, 0), pitch=wave(7, 0.15, 1), yaw=wave(13, 0.2, 2), throttle=wave(9, 0.15, 3))
drift.centre(1.0, throttle=0.0).write("tired-drift")
chatter = Sticks("poshold")
for _ in range(1000):
    sticks = {name: tired.uniform(-0.08, 0.08) for name in ("roll", "pitch", "yaw", "throttle")}
    chatter.hold(STEP, **sticks)
chatter.centre(1.0, throttle=0.0).write("tired-dead-zone")
tremble = Sticks("stabilize")
for frame in range(300):
    shake = 0.3 * math.sin(2 * math.pi * 6.0 * frame * STEP)
    tremble.hold(STEP, roll=shake, pitch=0.7 * shake, throttle=HOVER + 0.3 * shake)
tremble.recover().write("tired-tremble")
asleep = Sticks("althold").hold(1.0)
asleep.hold(8.0, roll=0.12, pitch=-0.1, yaw=0.3, throttle=0.0).centre(2.0).write("tired-thumb-rests")

# The arm switch.
for mode in ("stabilize", *HOLDING):
    for period in (0.02, 0.04, 0.1):
        switch = Sticks(mode).hold(1.0)
        for turn in range(int(2.0 / period)):
            switch.hold(period, arm=turn % 2)
        switch.hold(1.0, arm=1).recover(8.0).write(f"arm-chatter-{mode}-{period}s")
    Sticks(mode).hold(1.0).hold(0.3, arm=0).hold(0.5, arm=1).recover(8.0).write(f"arm-off-and-on-{mode}")
Sticks("poshold", arm=0).hold(2.0).hold(10.0, arm=1).hold(8.0, arm=0).write("arm-before-ready")
Sticks("poshold", arm=0).hold(READY).hold(0.2, arm=1).hold(0.2, arm=0).hold(0.3, arm=1).hold(3.0, arm=0).write("arm-on-off-on-ground")
Sticks("stabilize", arm=0, throttle=1.0).hold(READY).hold(2.0, arm=1).hold(1.0, throttle=-1.0).hold(1.0, arm=0).write("arm-full-throttle")
Sticks("poshold").hold(1.0).hold(0.5, kill=1).hold(4.0, kill=0).write("kill-and-back")
Sticks("poshold").hold(1.0).hold(0.1, land=1).hold(12.0, land=0).write("land-column")
Sticks("althold").hold(1.0).hold(0.1, land=1).hold(1.0, land=0).hold(2.0, roll=1.0, throttle=1.0).centre(8.0, throttle=0.0).write("land-column-and-fly-on")

# A landing by hand, hard and soft, and a take-off from a lean.
soft = Sticks("stabilize").hold(0.5).hold(3.0, throttle=0.54).hold(1.5, throttle=0.5).hold(1.0, throttle=-1.0).hold(1.0, arm=0)
soft.write("land-stabilize")
Sticks("stabilize").hold(0.5).hold(6.0, throttle=0.35).hold(1.0, throttle=-1.0).hold(1.0, arm=0).write("land-hard")
Sticks("poshold").hold(0.5).hold(8.0, throttle=-1.0).hold(6.0, arm=0).write("land-poshold-down")
lean = from_ground("stabilize").hold(1.0, throttle=0.8, roll=0.5).centre(0.5, throttle=0.6)
lean.recover(6.0).write("take-off-leaning")
from_ground("stabilize").hold(3.0, throttle=0.3).hold(2.0, throttle=0.7).recover(6.0).write("take-off-slow")
