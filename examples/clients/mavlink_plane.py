"""Flies a mission of the fixed-wing aircraft with pymavlink, then comes home: python mavlink_plane.py tcp:127.0.0.1:5760"""

import math
import sys
import time

from mavlink_square import Vehicle
from pymavlink.dialects.v20 import common as mavlink

ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
# A place is reached within this distance, m, and an orbit has this radius.
REACH, RADIUS = 110.0, 70.0
METRES = 111_320.0


class Plane(Vehicle):
    KIND = mavlink.MAV_TYPE_FIXED_WING
    # Its time passes ten times as fast.
    ALIVE = 0.05

    def place(self):
        place = self.receive("GLOBAL_POSITION_INT", 20)
        assert place is not None, "it says nothing of where it is"
        return place

    def away(self, home, place=None):
        """From home, m north and east."""
        place = place or self.place()
        north = (place.lat - home.lat) * 1e-7 * METRES
        return north, (place.lon - home.lon) * 1e-7 * METRES * math.cos(math.radians(home.lat * 1e-7))

    def upload(self, items):
        """The mission protocol: it asks for one item after the other."""
        system = self.line.target_system
        self.line.mav.mission_count_send(system, 1, len(items), mavlink.MAV_MISSION_TYPE_MISSION)
        asked = []
        while True:
            said = self.receive(["MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"], 5)
            assert said is not None, f"{asked} of {len(items)} items asked for"
            if said.get_type() == "MISSION_ACK":
                assert said.type == mavlink.MAV_MISSION_ACCEPTED and asked == list(range(len(items))), (said, asked)
                return
            if said.seq not in asked:
                asked.append(said.seq)
            command, first, latitude, longitude, height = items[said.seq]
            frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
            self.line.mav.mission_item_int_send(
                system, 1, said.seq, frame, command, 0, 1, first, 0, 0, math.nan, latitude, longitude, height
            )

    def arm(self):
        until = time.monotonic() + 20
        while self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) != ACCEPTED:
            assert time.monotonic() < until, "it does not arm"
            self.receive("HEARTBEAT", 0.1)
        self.wait_until("armed", "HEARTBEAT", lambda beat: beat.base_mode & ARMED, 5)

    def follow_mission(self, home, places):
        """Every item in its order, each at its place."""
        reached, seconds = [], time.monotonic()
        while len(reached) < len(places):
            said = self.receive(["MISSION_ITEM_REACHED", "GLOBAL_POSITION_INT", "STATUSTEXT"], 3)
            assert said is not None and time.monotonic() - seconds < 90, f"{reached} reached"
            if said.get_type() == "STATUSTEXT":
                print(f"vehicle: {said.text}")
            elif said.get_type() == "GLOBAL_POSITION_INT":
                here = said
            elif said.seq not in reached:
                reached.append(said.seq)
                place = places[said.seq]
                north, east = self.away(home, here)
                print(f"item {said.seq}: {north:.0f} m north, {east:.0f} m east, {here.relative_alt / 1e3:.0f} m up")
                if place:
                    off = math.hypot(north - place[0], east - place[1])
                    assert off < REACH + 30, f"{off:.0f} m from {place}"
        assert reached == list(range(len(places))), reached


def main():
    vehicle = Plane(sys.argv[1])
    first = vehicle.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    assert first == DENIED, f"it arms before it knows where it is: {first}"
    home = vehicle.place()
    vehicle.arm()

    field = [(300, 0, 60), (300, -300, 60), (-300, -300, 70), (-300, 0, 60)]
    scale = METRES * math.cos(math.radians(home.lat * 1e-7))
    on_earth = lambda north, east: (home.lat + round(north / METRES * 1e7), home.lon + round(east / scale * 1e7))
    items = [(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 40)]
    items += [(mavlink.MAV_CMD_NAV_WAYPOINT, 0, *on_earth(north, east), up) for north, east, up in field]
    items += [(mavlink.MAV_CMD_NAV_LOITER_TIME, 10, *on_earth(-300, 0), 60), (mavlink.MAV_CMD_NAV_LAND, 0, 0, 0, 0)]
    vehicle.upload(items)
    print(f"{len(items)} items uploaded")
    assert vehicle.command(mavlink.MAV_CMD_MISSION_START) == ACCEPTED
    vehicle.follow_mission(home, [None] + field + [field[-1], None])
    vehicle.wait_until("landed and disarmed", "HEARTBEAT", lambda beat: not beat.base_mode & ARMED, 20)
    place = vehicle.place()
    off = math.hypot(*vehicle.away(home, place))
    print(f"{off:.0f} m from where it took off, {place.relative_alt / 1e3:.1f} m up")
    assert off < 150 and abs(place.relative_alt) < 3_000, place

    # Again, and home from somewhere.
    vehicle.arm()
    assert vehicle.command(mavlink.MAV_CMD_MISSION_START) == ACCEPTED
    far = lambda place: math.hypot(*vehicle.away(home, place)) > 350 and place.relative_alt > 50_000
    vehicle.wait_until("on its way", "GLOBAL_POSITION_INT", far, 60)
    guided = mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    assert vehicle.command(mavlink.MAV_CMD_DO_SET_MODE, guided) == ACCEPTED
    since, places = time.monotonic(), []
    while time.monotonic() - since < 6:
        places.append(vehicle.away(home))
    assert max(math.dist(one, places[-1]) for one in places) < 3 * RADIUS, "it holds"
    assert max(math.dist(one, places[-1]) for one in places) > RADIUS, "in a circle"
    print("it holds in a circle")
    assert vehicle.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH) == ACCEPTED
    near = lambda place: math.hypot(*vehicle.away(home, place)) < RADIUS + 20
    vehicle.wait_until("at home", "GLOBAL_POSITION_INT", near, 30)
    since = time.monotonic()
    while time.monotonic() - since < 8:
        north, east = vehicle.away(home)
        assert math.hypot(north, east) < 2 * RADIUS + 60, f"{north:.0f} m north, {east:.0f} m east"
    print("it circles at home")
    assert vehicle.command(mavlink.MAV_CMD_NAV_LAND) == ACCEPTED
    vehicle.wait_until("landed and disarmed", "HEARTBEAT", lambda beat: not beat.base_mode & ARMED, 60)


main()
