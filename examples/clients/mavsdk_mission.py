"""Flies missions with MAVSDK: python mavsdk_mission.py udpin://127.0.0.1:14550"""

import math
import sys
import threading
import time

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.action import Action
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionItem as RawItem
from mavsdk.plugins.mission_raw import MissionRaw, MissionRawError
from mavsdk.plugins.param import Param, ParamError
from mavsdk.plugins.telemetry import Telemetry

NAN = math.nan
LOCAL_NED, GLOBAL_RELATIVE = 1, 6
WAYPOINT, LAND, TAKE_OFF, START_CAPTURE = 16, 21, 22, 2000
SIDE, HEIGHT = 0.8, 0.6
# Where the room is that it flies in: anywhere.
LATITUDE, LONGITUDE, ALTITUDE = 47.3977418, 8.5455939, 488.0
METRES_PER_DEGREE = 111_319.49


def item(seq, command, frame=LOCAL_NED, north=0.0, east=0.0, up=0.0, hold=0.0):
    """An item of a mission. Local coordinates travel in tenths of a millimetre."""
    x, y = round(north * 1e4), round(east * 1e4)
    z = -up if frame == LOCAL_NED else up
    return RawItem(seq, frame, command, int(seq == 0), 1, hold, 0.0, 0.0, NAN, x, y, z, 0)


def wait_until(what, condition, seconds):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, f"not {what} after {seconds} s"
        time.sleep(0.1)
    print(what)


def refused(do, error):
    """Why something is refused."""
    try:
        do()
    except error as why:
        return why.result.name
    raise AssertionError("accepted")


def main():
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    mavsdk.add_any_connection(sys.argv[1])
    system = mavsdk.first_autopilot(10.0)
    assert system is not None, "no vehicle"
    telemetry, action, param = Telemetry(system), Action(system), Param(system)
    mission_raw, mission = MissionRaw(system), Mission(system)

    def is_healthy():
        health = telemetry.health()
        calibrated = health.is_gyrometer_calibration_ok and health.is_accelerometer_calibration_ok
        return calibrated and health.is_local_position_ok and health.is_armable

    wait_until("healthy", is_healthy, 20)

    gain = param.get_param_float("rate.roll.kp")
    param.set_param_float("rate.roll.kp", 1.25 * gain)
    assert abs(param.get_param_float("rate.roll.kp") / gain - 1.25) < 1e-5
    param.set_param_float("rate.roll.kp", gain)
    print(f"a parameter of {len(param.get_all_params().float_params)} was changed and put back")

    # What it cannot do is refused, with the reason.
    photo = [item(0, TAKE_OFF, up=HEIGHT), item(1, START_CAPTURE)]
    print("a camera:", refused(lambda: mission_raw.upload_mission(photo), MissionRawError))
    nowhere = [item(0, WAYPOINT, GLOBAL_RELATIVE, north=4.7e4, east=8.5e3, up=HEIGHT)]
    print("a place on Earth:", refused(lambda: mission_raw.upload_mission(nowhere), MissionRawError))
    far = [item(0, WAYPOINT, north=5_000.0, up=HEIGHT)]
    print("five kilometres:", refused(lambda: mission_raw.upload_mission(far), MissionRawError))

    corners = [(SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE), (0.0, 0.0)]
    square = [item(1 + place, WAYPOINT, north=n, east=e, up=HEIGHT, hold=0.5) for place, (n, e) in enumerate(corners)]
    square = [item(0, TAKE_OFF, up=HEIGHT), *square, item(5, LAND)]
    mission_raw.upload_mission(square)
    downloaded = mission_raw.download_mission()

    def same(one, other):
        fields = ["seq", "frame", "command", "param1", "x", "y"]
        return all(getattr(one, name) == getattr(other, name) for name in fields) and abs(one.z - other.z) < 1e-6

    assert len(downloaded) == 6 and all(map(same, square, downloaded)), downloaded
    print(f"{len(square)} items uploaded, and the same downloaded")

    reached = []
    mission_raw.subscribe_mission_progress(lambda progress, *_: reached.append(progress.current))
    action.arm()
    mission_raw.start_mission()
    wait_until("in the air", telemetry.in_air, 15)
    wait_until("paused at the second corner", lambda: reached and reached[-1] >= 2, 30)
    mission_raw.pause_mission()
    time.sleep(2.0)
    assert reached[-1] < 5, reached
    mission_raw.start_mission()
    wait_until("flown, landed and disarmed", lambda: not telemetry.armed(), 60)
    print("items:", sorted(set(reached)))

    # Told where on Earth it is, it takes the same on a map.
    action.set_gps_global_origin(LATITUDE, LONGITUDE, ALTITUDE)
    wait_until("at home on Earth", lambda: telemetry.health().is_home_position_ok, 10)
    east = METRES_PER_DEGREE * math.cos(math.radians(LATITUDE))
    places = [(LATITUDE + n / METRES_PER_DEGREE, LONGITUDE + e / east) for n, e in corners[:2]]
    plan = MissionPlan([MissionItem(lat, lon, HEIGHT, 0.4, False, acceptance_radius_m=0.2) for lat, lon in places])
    mission.upload_mission(plan)
    back = mission.download_mission().mission_items
    assert len(back) == 2 and all(abs(a.latitude_deg - b[0]) < 2e-7 for a, b in zip(back, places)), back
    wait_until("ready again", is_healthy, 20)
    action.arm()
    mission.start_mission()
    wait_until("the mission on the map is flown", mission.is_mission_finished, 40)
    place = telemetry.position()
    north = (place.latitude_deg - LATITUDE) * METRES_PER_DEGREE
    assert abs(north - SIDE) < 0.3 and abs(place.relative_altitude_m - HEIGHT) < 0.3, place
    action.land()
    wait_until("landed", lambda: not telemetry.armed(), 30)


main()
