"""Flies a square with pymavlink: python mavlink_square.py tcp:127.0.0.1:5760, or /dev/ttyACM0 for a vehicle on USB"""

import sys
import time

from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

SIDE = 0.8
HEIGHT = 0.6
# A place is reached within this distance, m.
NEAR = 0.2


class Vehicle:
    KIND = mavlink.MAV_TYPE_QUADROTOR
    # How often somebody is there, s.
    ALIVE = 0.5

    def __init__(self, address):
        self.line = mavutil.mavlink_connection(address)
        self.alive = 0.0
        # A vehicle on a cable says nothing in MAVLink before it has heard any.
        beat = self.receive("HEARTBEAT", 10)
        assert beat is not None, "no heartbeat"
        assert beat.type == self.KIND, beat
        self.line.target_component = 1
        print(f"connected to system {self.line.target_system}")

    def receive(self, kinds, seconds):
        """The next message of these kinds; says meanwhile that somebody is there."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if time.monotonic() - self.alive > self.ALIVE:
                self.alive = time.monotonic()
                self.line.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            message = self.line.recv_match(type=kinds, blocking=True, timeout=0.1)
            if message is not None:
                return message
        return None

    def parameters(self):
        self.line.mav.param_request_list_send(self.line.target_system, 1)
        found, count = {}, None
        while count is None or len(found) < count:
            value = self.receive("PARAM_VALUE", 5)
            assert value is not None, f"{len(found)} of {count} parameters"
            found[value.param_id], count = value.param_value, value.param_count
        return found

    def set_parameter(self, name, value):
        self.line.mav.param_set_send(self.line.target_system, 1, name.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32)
        while True:
            answer = self.receive("PARAM_VALUE", 5)
            assert answer is not None, f"no answer for {name}"
            if answer.param_id == name:
                return answer.param_value

    def command(self, number, *parameters):
        """Sends a command, prints what the vehicle says, and returns the result."""
        parameters = list(parameters) + [0] * (7 - len(parameters))
        self.line.mav.command_long_send(self.line.target_system, 1, number, 0, *parameters)
        while True:
            answer = self.receive(["COMMAND_ACK", "STATUSTEXT"], 5)
            assert answer is not None, f"command {number} is not acknowledged"
            if answer.get_type() == "COMMAND_ACK" and answer.command == number:
                return answer.result
            if answer.get_type() == "STATUSTEXT":
                print(f"vehicle: {answer.text}")

    def wait_until(self, what, kind, condition, seconds):
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            message = self.receive(kind, 1)
            if message is not None and condition(message):
                print(what)
                return
        raise AssertionError(f"not {what} after {seconds} s")

    def go_to(self, north, east, up):
        only_position = 0b110111111000
        send = self.line.mav.set_position_target_local_ned_send
        send(0, self.line.target_system, 1, mavlink.MAV_FRAME_LOCAL_NED, only_position, north, east, -up, *[0] * 8)

        def is_there(place):
            return max(abs(place.x - north), abs(place.y - east), abs(place.z + up)) < NEAR

        self.wait_until(f"at {north:.1f} m north, {east:.1f} m east, {up:.1f} m up", "LOCAL_POSITION_NED", is_there, 15)

    def fly_at(self, north, east, seconds):
        """Flies at a velocity, which is said ten times a second, and returns how far it has come."""
        only_velocity = 0b110111000111
        send = self.line.mav.set_position_target_local_ned_send
        begin = self.receive("LOCAL_POSITION_NED", 2)
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            send(0, self.line.target_system, 1, mavlink.MAV_FRAME_LOCAL_NED, only_velocity, 0, 0, 0, north, east, *[0] * 6)
            self.receive("HEARTBEAT", 0.1)
        end = self.receive("LOCAL_POSITION_NED", 2)
        return end.x - begin.x, end.y - begin.y


def main():
    vehicle = Vehicle(sys.argv[1])

    parameters = vehicle.parameters()
    print(f"{len(parameters)} parameters")
    gain = parameters["rate.roll.kp"]
    assert abs(vehicle.set_parameter("rate.roll.kp", 1.05 * gain) / gain - 1.05) < 1e-5
    assert abs(vehicle.set_parameter("rate.roll.kp", 1e9) / gain - 1.05) < 1e-5, "out of range"
    assert abs(vehicle.set_parameter("rate.roll.kp", gain) / gain - 1.0) < 1e-5
    print("a parameter was changed, refused out of range, and put back")

    assert vehicle.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, HEIGHT) != 0, "took off disarmed"
    assert vehicle.command(mavlink.MAV_CMD_DO_SET_SERVO, 1, 1500) == mavlink.MAV_RESULT_UNSUPPORTED
    until = time.monotonic() + 20
    while vehicle.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) != mavlink.MAV_RESULT_ACCEPTED:
        assert time.monotonic() < until, "it does not arm"
        time.sleep(1)
    # An acknowledgement means that it has happened: the next command needs no pause.
    assert vehicle.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, HEIGHT) == mavlink.MAV_RESULT_ACCEPTED
    armed = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    vehicle.wait_until("armed", "HEARTBEAT", lambda beat: beat.base_mode & armed, 5)
    in_air = mavlink.MAV_LANDED_STATE_IN_AIR
    vehicle.wait_until("in the air", "EXTENDED_SYS_STATE", lambda state: state.landed_state == in_air, 10)
    assert abs(vehicle.set_parameter("rate.roll.kp", 1.2 * gain) / gain - 1.2) < 1e-5, "a gain changes in flight"
    assert abs(vehicle.set_parameter("eskf.gate", parameters["eskf.gate"]) / parameters["eskf.gate"] - 1.0) < 1e-5
    waits = vehicle.receive("STATUSTEXT", 5)
    assert waits is not None and "eskf.gate: not in flight" in waits.text, waits
    print("a gain was changed in flight, and another parameter waits")

    for north, east in [(SIDE, 0), (SIDE, SIDE), (0, SIDE), (0, 0)]:
        vehicle.go_to(north, east, HEIGHT)

    north, east = vehicle.fly_at(0.3, -0.2, 3)
    print(f"came {north:.2f} m north and {-east:.2f} m west in three seconds")
    assert abs(north - 0.8) < 0.25 and abs(east + 0.5) < 0.25, (north, east)
    vehicle.line.mav.log_request_list_send(vehicle.line.target_system, 1, 0, 0xFFFF)
    logs = vehicle.receive("LOG_ENTRY", 2)
    assert logs is not None and logs.num_logs == 0, logs

    assert vehicle.command(mavlink.MAV_CMD_NAV_LAND) == mavlink.MAV_RESULT_ACCEPTED
    vehicle.wait_until("landed and disarmed", "HEARTBEAT", lambda beat: not beat.base_mode & armed, 20)
    lost = vehicle.line.mav_loss
    print(f"{vehicle.line.mav_count} messages, {lost} lost")
    assert lost == 0


if __name__ == "__main__":
    main()
