"""Reads the STM32 quadcopter and changes a gain with pymavlink: python mavlink_quad.py tcp:127.0.0.1:5760"""

import math
import sys
import time

from mavlink_square import Vehicle
from pymavlink.dialects.v20 import common as mavlink

# A whole turn of the sensors' calibration and the pilot's: it is level from then on.
CALIBRATED = 5.0


def main():
    vehicle = Vehicle(sys.argv[1])
    armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    is_ready = lambda beat: beat.system_status == mavlink.MAV_STATE_STANDBY and not beat.base_mode & armed
    vehicle.wait_until("ready, and disarmed", "HEARTBEAT", is_ready, 15)

    since, level = time.monotonic(), 90.0
    while time.monotonic() - since < 15 and not (time.monotonic() - since > CALIBRATED and level < 2.0):
        attitude = vehicle.receive("ATTITUDE", 2)
        assert attitude is not None, "no attitude"
        level = math.degrees(max(abs(attitude.roll), abs(attitude.pitch)))
    print(f"roll {math.degrees(attitude.roll):.2f} deg, pitch {math.degrees(attitude.pitch):.2f} deg")
    assert level < 2.0, "it stands, and its pilot has calibrated it"
    status = vehicle.receive("SYS_STATUS", 3)
    print(f"battery {status.voltage_battery / 1e3:.2f} V")
    assert 7.0 < status.voltage_battery / 1e3 < 8.8, "two cells"
    servos = vehicle.receive("SERVO_OUTPUT_RAW", 3)
    assert [servos.servo1_raw, servos.servo2_raw, servos.servo3_raw, servos.servo4_raw] == [1000] * 4, servos
    assert vehicle.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == 0
    assert vehicle.receive("LOCAL_POSITION_NED", 2) is None, "it does not know where it is"

    parameters = vehicle.parameters()
    print(f"{len(parameters)} parameters")
    assert len(parameters) == 30, sorted(parameters)
    gain = parameters["roll.p"]
    assert abs(vehicle.set_parameter("roll.p", 0.25) - 0.25) < 1e-6
    assert abs(vehicle.set_parameter("roll.p", 1e9) - 0.25) < 1e-6, "out of range"
    assert vehicle.command(mavlink.MAV_CMD_PREFLIGHT_STORAGE, 1) == mavlink.MAV_RESULT_ACCEPTED
    time.sleep(0.2)
    assert abs(vehicle.parameters()["roll.p"] - 0.25) < 1e-6, "the parameters in use"
    assert abs(vehicle.set_parameter("roll.p", gain) - gain) < 1e-6
    print("a parameter was changed, refused out of range, kept, and put back")

    # Its transmitter's sticks alone arm and fly it.
    refused = mavlink.MAV_RESULT_UNSUPPORTED
    for number, first in [
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1),
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0),
        (mavlink.MAV_CMD_NAV_LAND, 0),
        (mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1),
    ]:
        answer = vehicle.command(number, first)
        assert answer == refused, (number, first, answer)
    for _ in range(10):
        vehicle.line.mav.manual_control_send(vehicle.line.target_system, 0, 0, 1000, 1000, 0)
        beat = vehicle.receive("HEARTBEAT", 2)
        assert beat is not None and not beat.base_mode & armed
        servos = vehicle.receive("SERVO_OUTPUT_RAW", 3)
        assert servos.servo1_raw == 1000, servos
    print("arming, landing, a restart and sticks: not of this vehicle")


main()
