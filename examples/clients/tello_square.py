"""Flies a square with djitellopy: python tello_square.py 127.0.0.1:8889 [port of djitellopy] [port for the state]"""

import sys
import time

from djitellopy import Tello

SIDE = 50


def connect():
    host, port = sys.argv[1].split(":")
    if len(sys.argv) > 2:
        # On one machine with the vehicle, djitellopy needs other ports for itself.
        Tello.CONTROL_UDP_PORT, Tello.STATE_UDP_PORT = int(sys.argv[2]), int(sys.argv[3])
    tello = Tello(host)
    tello.address = (host, int(port))
    tello.connect()
    return tello


def near(value, wanted, by):
    turned = (value - wanted + 180) % 360 - 180
    return abs(turned) <= by


def main():
    tello = connect()
    print(f"battery {tello.get_battery()} %, attitude {tello.query_attitude()}")
    try:
        tello.move_forward(SIDE)
        raise AssertionError("it moved on the ground")
    except Exception as error:
        assert "not flying" in str(error), error
    tello.takeoff()
    print(f"took off to {tello.get_height()} cm")
    assert 35 <= tello.get_height() <= 65, tello.get_height()
    for corner in range(1, 5):
        tello.move_forward(SIDE)
        tello.rotate_clockwise(90)
        # Its state comes ten times a second, and what has just turned swings a little.
        until = time.monotonic() + 3
        while not near(tello.get_yaw(), 90 * corner, 8) and time.monotonic() < until:
            time.sleep(0.1)
        print(f"corner {corner}: heading {tello.get_yaw()} degrees, height {tello.get_height()} cm")
        assert near(tello.get_yaw(), 90 * corner, 8), tello.get_yaw()
    tello.move_up(30)
    print(f"rose to {tello.get_height()} cm")
    assert 65 <= tello.get_height() <= 95, tello.get_height()
    tello.land()
    print(f"landed after {tello.get_flight_time()} s in the air, battery {tello.get_battery()} %")


main()
