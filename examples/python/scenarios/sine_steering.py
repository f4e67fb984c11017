"""A scenario in Python: steering that swings faster and faster, until the rover cannot follow it.

    python3 scenarios/sine_steering.py [HOST:PORT]
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from stampfly_rover import DEFAULT_ADDRESS, OperatorCommand, RoverClient  # noqa: E402

#: Frequencies of the swing, Hz, and the time driven at each, s.
FREQUENCIES = (0.5, 1.0, 2.0, 4.0)
EACH = 2.0


def command(t: float) -> OperatorCommand:
    """0.3 of full steering at one frequency after the other, at 1 m/s."""
    frequency = FREQUENCIES[min(int(t / EACH), len(FREQUENCIES) - 1)]
    return OperatorCommand(throttle=0.5 if t < 1.0 else 0.0, steer=0.3 * math.sin(math.tau * frequency * t))


def main() -> int:
    host, _, port = sys.argv[1].rpartition(":") if len(sys.argv) > 1 else ("", "", "")
    largest = [0.0] * len(FREQUENCIES)
    with RoverClient((host, int(port)) if port else DEFAULT_ADDRESS) as rover:
        first = None
        for record in rover.drive(command, EACH * len(FREQUENCIES)):
            first = first or record
            step = int((record.t - first.t) / EACH)
            # The second half of each frequency, when it has settled.
            if step < len(FREQUENCIES) and (record.t - first.t) % EACH > EACH / 2:
                largest[step] = max(largest[step], abs(record.steer_angle_cmd))
    for frequency, angle in zip(FREQUENCIES, largest):
        # First-order lag of 0.15 s: 0.12 rad / sqrt(1 + (2 pi f tau)^2).
        expected = 0.12 / math.hypot(1.0, math.tau * frequency * 0.15)
        print(f"{frequency:4.1f} Hz: {angle:.3f} rad, a lag of 0.15 s gives {expected:.3f} rad")
    return 0 if first else 1


if __name__ == "__main__":
    sys.exit(main())
