"""Signs with pymavlink, and shows that others are ignored: python mavlink_signed.py tcp:192.0.2.7:5760 PHRASE [PARAMETER]"""

import hashlib
import os
import sys
import time

# From the first message on: version 1 has no signatures.
os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402
from pymavlink.dialects.v20 import common as mavlink  # noqa: E402

# One that the vehicle has.
NAME = sys.argv[3] if len(sys.argv) > 3 else "rate.roll.kp"


def connect(address, key=None):
    line = mavutil.mavlink_connection(address)
    if key is not None:
        line.setup_signing(key, sign_outgoing=True)
    return line


def beat(line):
    line.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)


def parameter(line, seconds):
    """Asks for a parameter, again and again."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        beat(line)
        line.mav.param_request_read_send(1, 1, NAME.encode(), -1)
        value = line.recv_match(type="PARAM_VALUE", blocking=True, timeout=0.5)
        if value is not None:
            return value.param_value
    return None


def main():
    # As ground stations do it.
    key = hashlib.sha256(sys.argv[2].encode()).digest()

    own = connect(sys.argv[1], key)
    assert own.wait_heartbeat(timeout=10) is not None, "no heartbeat that is signed with the key"
    value = parameter(own, 5)
    assert value is not None, "a signed question is not answered"
    print(f"signed: {NAME} is {value:.6f}")

    stranger = connect(sys.argv[1])
    assert parameter(stranger, 3) is None, "an unsigned question is answered"
    forger = connect(sys.argv[1], bytes(32))
    assert parameter(forger, 3) is None, "a question that is signed with another key is answered"
    print("unsigned, and signed with another key: no answer")
    # Motors off is everybody's, but not a stranger's.
    stranger.mav.command_long_send(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 21196, 0, 0, 0, 0, 0)
    assert stranger.recv_match(type="COMMAND_ACK", blocking=True, timeout=1) is None

    until = time.monotonic() + 10
    while time.monotonic() < until:
        beat(own)
        text = own.recv_match(type="STATUSTEXT", blocking=True, timeout=0.5)
        if text is not None and "not signed" in text.text:
            print(f"vehicle: {text.text}")
            break
    else:
        raise AssertionError("nobody counts")
    assert parameter(own, 5) == value


main()
