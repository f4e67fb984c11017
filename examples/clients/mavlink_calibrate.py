"""Calibrates the level with pymavlink: python mavlink_calibrate.py tcp:127.0.0.1:5760. The vehicle has to stand on a level table, disarmed."""

import sys
import time

from mavlink_square import Vehicle
from pymavlink.dialects.v20 import common as mavlink

CALIBRATE = mavlink.MAV_CMD_PREFLIGHT_CALIBRATION
# MAV_RESULT_CANCELLED, which pymavlink leaves out because its description says that it is not final.
CANCELLED = 6
LEVEL = [0, 0, 0, 0, 2, 0, 0]
SIX = [0, 0, 0, 0, 1, 0, 0]


def calibrate(vehicle, parameters, seconds):
    """Asks for a calibration. Returns every result that it is acknowledged with, and what the vehicle says meanwhile."""
    vehicle.line.mav.command_long_send(vehicle.line.target_system, 1, CALIBRATE, 0, *parameters)
    results, texts, until = [], [], time.monotonic() + seconds
    while time.monotonic() < until:
        message = vehicle.receive(["COMMAND_ACK", "STATUSTEXT"], 2)
        assert message is not None, f"nothing for two seconds, after {results}"
        if message.get_type() == "STATUSTEXT":
            # Sentences of more than 50 characters come in pieces.
            texts.append(message.text) if message.chunk_seq == 0 else texts.append(texts.pop() + message.text)
        elif message.command == CALIBRATE:
            results.append(message.result)
            if message.result != mavlink.MAV_RESULT_IN_PROGRESS:
                return results, texts
    return results, texts


def main():
    vehicle = Vehicle(sys.argv[1])
    names = sorted(name for name in vehicle.parameters() if name.startswith("calibratio~"))
    before = vehicle.parameters()
    assert len(names) >= 6, names

    results, texts = calibrate(vehicle, LEVEL, 60)
    print("\n".join(texts))
    assert results[0] == mavlink.MAV_RESULT_IN_PROGRESS and len(results) > 2, results
    assert results[-1] == mavlink.MAV_RESULT_ACCEPTED, results
    said = [text for text in texts if text.startswith("[cal] ")]
    assert said[0] == "[cal] calibration started: 2 level" and said[-1] == "[cal] calibration done: level", said
    assert any(text.startswith("[cal] progress <") for text in said), said
    after = vehicle.parameters()
    changed = [name for name in names if before[name] != after[name]]
    assert len(changed) == 2 and all(0.0 < abs(after[name]) < 0.1 for name in changed), changed
    others = [name for name in after if name not in names and before[name] != after[name]]
    assert not others, others
    print("found " + ", ".join(f"{after[name]:.5f}" for name in changed) + " rad: roll and pitch of the sensor in the airframe")

    # The gyro is measured after every power-on; nothing else may be asked for together; and it is honest about both.
    assert calibrate(vehicle, [1, 0, 0, 0, 0, 0, 0], 5)[0] == [mavlink.MAV_RESULT_UNSUPPORTED]
    assert calibrate(vehicle, [0, 1, 0, 0, 2, 0, 0], 5)[0] == [mavlink.MAV_RESULT_DENIED]

    # One that is cancelled changes nothing.
    vehicle.line.mav.command_long_send(vehicle.line.target_system, 1, CALIBRATE, 0, *SIX)
    first = vehicle.receive("COMMAND_ACK", 5)
    assert first is not None and first.result == mavlink.MAV_RESULT_IN_PROGRESS, first
    results, texts = calibrate(vehicle, [0] * 7, 5)
    results = [result for result in results if result != mavlink.MAV_RESULT_IN_PROGRESS]
    second = vehicle.receive("COMMAND_ACK", 5)
    while second is not None and second.result == mavlink.MAV_RESULT_IN_PROGRESS:
        second = vehicle.receive("COMMAND_ACK", 5)
    assert results == [mavlink.MAV_RESULT_ACCEPTED] and second.result == CANCELLED, (results, second)
    assert vehicle.parameters() == after
    print("cancelled, and nothing has changed")

    # Nobody calibrates an armed vehicle.
    until = time.monotonic() + 20
    while vehicle.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) != mavlink.MAV_RESULT_ACCEPTED:
        assert time.monotonic() < until, "it does not arm"
        time.sleep(0.5)
    vehicle.wait_until(
        "armed", "HEARTBEAT", lambda beat: beat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED, 5
    )
    results, texts = calibrate(vehicle, LEVEL, 5)
    assert results == [mavlink.MAV_RESULT_DENIED], results
    print("\n".join(texts))
    assert vehicle.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0) == mavlink.MAV_RESULT_ACCEPTED
    print("and it is refused while it is armed")


if __name__ == "__main__":
    main()
