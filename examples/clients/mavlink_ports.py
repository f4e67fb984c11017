"""Signs with pymavlink at a vehicle's ports in a network: python mavlink_ports.py udpout:192.0.2.7:14550 tcp:192.0.2.7:5760 PHRASE"""

import hashlib
import os
import sys
import time

# From the first message on: version 1 has no signatures.
os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402
from pymavlink.dialects.v20 import common as mavlink  # noqa: E402


def connect(address, key=None):
    line = mavutil.mavlink_connection(address)
    if key is not None:
        line.setup_signing(key, sign_outgoing=True)
    return line


def parameter(line, seconds):
    """Asks for a parameter, again and again. Whoever speaks first in datagrams is answered."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        line.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        line.mav.param_request_read_send(1, 1, b"rate.roll.kp", -1)
        value = line.recv_match(type="PARAM_VALUE", blocking=True, timeout=0.5)
        if value is not None:
            return value.param_value
    return None


def main():
    datagrams, stream = sys.argv[1:3]
    # As ground stations do it.
    key = hashlib.sha256(sys.argv[3].encode()).digest()

    for name, line in (("datagrams", connect(datagrams, key)), ("stream", connect(stream, key))):
        before = line.mav.signing.timestamp
        value = parameter(line, 10)
        assert value is not None, f"{name}: a signed question is not answered"
        ahead = line.mav.signing.timestamp - before
        print(f"{name}: rate.roll.kp is {value:.6f}; the vehicle's clock was {ahead / 1e5 / 86400:.0f} days ahead")

    for name, wrong in (("unsigned", None), ("signed with another key", bytes(32))):
        stranger = connect(datagrams, wrong)
        assert parameter(stranger, 2) is None, f"{name}: a question is answered"
        # Motors off is everybody's, but not a stranger's.
        stranger.mav.command_long_send(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, 21196, 0, 0, 0, 0, 0)
        assert stranger.recv_match(type="COMMAND_ACK", blocking=True, timeout=1) is None
        print(f"{name}: no answer")


main()
