"""What an ideal satellite receiver says."""

import math
from collections.abc import Callable

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def test_gps_raw_int(moment: Moment, observed: Observed) -> None:
    m = observed.sent("GPS_RAW_INT", moment())
    assert (m.time_usec, m.fix_type, m.satellites_visible) == (12347500, mav.GPS_FIX_TYPE_3D_FIX, 16)
    assert (m.lat, m.lon, m.alt, m.alt_ellipsoid) == (473977000, -85456000, 512250, 560000)
    assert (m.eph, m.epv) == (100, 100)  # dilution 1
    assert m.vel == round(math.hypot(15.125, 9.25) * 100)
    assert m.cog == round((math.degrees(math.atan2(-9.25, 15.125)) + 360.0) * 100)
    assert m.yaw == round((360.0 - math.degrees(0.75)) * 100)
    assert (m.h_acc, m.v_acc, m.vel_acc, m.hdg_acc) == (1, 1, 1, 1)  # a millimetre; zero would be no statement


def test_who_stands_has_no_course_and_north_is_36000(moment: Moment, observed: Observed) -> None:
    m = observed.sent("GPS_RAW_INT", moment(velocity_ned=(0.0, 0.0, 0.0), yaw=0.0))
    assert (m.vel, m.cog, m.yaw) == (0, 65535, 36000)


def test_gnss_integrity(observed: Observed) -> None:
    m = observed.sent("GNSS_INTEGRITY")
    assert (m.id, m.system_errors) == (0, 0)
    assert m.jamming_state == mav.GPS_JAMMING_STATE_NOT_JAMMED
    assert m.spoofing_state == mav.GPS_SPOOFING_STATE_NOT_SPOOFED
    assert m.authentication_state == mav.GPS_AUTHENTICATION_STATE_DISABLED
    assert m.raim_state == mav.GPS_RAIM_STATE_DISABLED
    assert (m.raim_hfom, m.raim_vfom, m.corrections_quality, m.post_processing_quality) == (65535, 65535, 255, 255)
    assert (m.system_status_summary, m.gnss_signal_quality) == (10, 10)
