"""Where the vehicle is and how it moves: every field computed a second time from its definition's units and frames."""

import math
from collections.abc import Callable

import pytest

from sitl.flight.mission_items import MissionItem
from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import EPOCH, Observed

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def test_attitude(moment: Moment, observed: Observed) -> None:
    m = observed.sent("ATTITUDE", moment())
    assert m.time_boot_ms == 12348  # 12.3475 s
    assert (m.roll, m.pitch, m.yaw) == pytest.approx((0.1, -0.2, -0.75))
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == pytest.approx((0.01, -0.02, 0.03))


def test_attitude_quaternion(moment: Moment, observed: Observed) -> None:
    m = observed.sent("ATTITUDE_QUATERNION", moment())
    assert m.time_boot_ms == 12348
    assert (m.q1, m.q2, m.q3, m.q4) == pytest.approx((0.9, 0.1, -0.2, math.sqrt(0.14)))
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == pytest.approx((0.01, -0.02, 0.03))
    assert m.repr_offset_q == [0.0] * 4


def test_local_position_ned(moment: Moment, observed: Observed) -> None:
    m = observed.sent("LOCAL_POSITION_NED", moment())
    assert m.time_boot_ms == 12348
    assert (m.x, m.y, m.z, m.vx, m.vy, m.vz) == (101.5, -203.25, -24.25, 15.125, -9.25, -2.5)


def test_global_position_int(moment: Moment, observed: Observed) -> None:
    m = observed.sent("GLOBAL_POSITION_INT", moment())
    assert (m.time_boot_ms, m.lat, m.lon, m.alt, m.relative_alt) == (12348, 473977000, -85456000, 512250, 24250)
    assert (m.vx, m.vy, m.vz) == (1512, -925, -250)  # cm/s; 1512.5 rounds to even
    assert m.hdg == round((360.0 - math.degrees(0.75)) * 100)


def test_relative_altitude_is_a_difference_of_altitudes_where_the_earth_is_curved(
    moment: Moment, observed: Observed
) -> None:
    observed.context.note(moment(altitude_msl=488.0, position_ned=(0.0, 0.0, 0.0)))
    # 10 km away at the same altitude the tangent plane has left the ground by d^2/2R = 7.8 m.
    away = moment(altitude_msl=488.0, position_ned=(10000.0, 0.0, 7.84))
    assert observed.sent("GLOBAL_POSITION_INT", away).relative_alt == 0
    assert observed.sent("ALTITUDE", away).altitude_relative == 0.0
    assert observed.sent("ALTITUDE", away).altitude_local == pytest.approx(-7.84)


@pytest.mark.parametrize(
    ("yaw", "cdeg", "deg"), [(0.0, 0, 0), (-1e-6, 0, 0), (math.pi, 18000, 180), (-math.pi / 2, 27000, 270)]
)
def test_headings_run_from_0_to_360_exclusive(
    moment: Moment, observed: Observed, yaw: float, cdeg: int, deg: int
) -> None:
    assert observed.sent("GLOBAL_POSITION_INT", moment(yaw=yaw)).hdg == cdeg
    assert observed.sent("VFR_HUD", moment(yaw=yaw)).heading == deg


def test_vfr_hud(moment: Moment, observed: Observed) -> None:
    m = observed.sent("VFR_HUD", moment())
    assert m.airspeed == pytest.approx(18.25 * math.sqrt(1.16 / 1.225))  # equivalent airspeed
    assert m.groundspeed == pytest.approx(math.sqrt(15.125**2 + 9.25**2))
    assert (m.heading, m.throttle, m.alt, m.climb) == (317, 55, 512.25, 2.5)


def test_altitude(moment: Moment, observed: Observed) -> None:
    m = observed.sent("ALTITUDE", moment())
    assert m.time_usec == 12347500
    # Standard atmosphere (1976), table: 950 hPa is at 540.3 m.
    assert m.altitude_monotonic == pytest.approx(540.3, abs=0.2)
    assert (m.altitude_amsl, m.altitude_local, m.altitude_relative) == (512.25, 24.25, 24.25)
    assert (m.altitude_terrain, m.bottom_clearance) == (23.5, 23.5)


def test_relative_altitude_counts_from_home_wherever_it_moves(moment: Moment, observed: Observed) -> None:
    home = observed.flight.home
    home.move(10.0, 20.0, -100.0)  # 588 m above mean sea level
    assert observed.sent("GLOBAL_POSITION_INT", moment(altitude_msl=600.0)).relative_alt == 12000


def test_utm_global_position(moment: Moment, observed: Observed) -> None:
    m = observed.sent("UTM_GLOBAL_POSITION", moment())
    assert m.time == round((EPOCH + 12.3475) * 1e6)
    assert (m.lat, m.lon, m.alt, m.relative_alt) == (473977000, -85456000, 560000, 23500)  # ellipsoid; ground
    assert (m.vx, m.vy, m.vz) == (1512, -925, -250)
    assert (m.h_acc, m.v_acc, m.vel_acc, m.update_rate) == (1, 1, 1, 0)
    assert m.uas_id == [0] * 18
    assert m.flight_state == mav.UTM_FLIGHT_STATE_AIRBORNE
    assert m.flags == 1 | 4 | 8 | 16 | 32 | 64  # everything but an id and a next place
    assert observed.sent("UTM_GLOBAL_POSITION", moment(on_ground=True)).flight_state == mav.UTM_FLIGHT_STATE_GROUND
    terminated = moment(mode="TERMINATION", landed="IN_AIR")
    assert observed.sent("UTM_GLOBAL_POSITION", terminated).flight_state == mav.UTM_FLIGHT_STATE_EMERGENCY


def test_utm_global_position_names_the_next_place_of_a_mission() -> None:
    flying = Observed(start="trim:20")
    flying.flight.load_mission([MissionItem(16, x=47.41, y=8.55, z=110.0), MissionItem(16, x=47.42, y=8.55, z=110.0)])
    flying.flight.start_mission()
    flying.fly(0.1)
    m = flying.sent("UTM_GLOBAL_POSITION")
    assert m.flags & mav.UTM_DATA_AVAIL_FLAGS_NEXT_WAYPOINT_AVAILABLE
    assert (m.next_lat, m.next_lon, m.next_alt) == pytest.approx((474100000, 85500000, 598000), abs=1)
