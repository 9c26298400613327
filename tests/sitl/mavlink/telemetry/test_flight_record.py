"""When the vehicle armed, took off, landed and left its fence."""

import pytest

from sitl.flight.geofence import FenceCircle
from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.telemetry.observed import Observed


def test_a_flight_from_arming_to_landing() -> None:
    observed = Observed()
    observed.fly(1.0)
    m = observed.sent("FLIGHT_INFORMATION")
    assert (m.time_boot_ms, m.arming_time_utc, m.takeoff_time_utc, m.flight_uuid, m.landing_time) == (1000, 0, 0, 0, 0)
    flight = observed.flight
    flight.takeoff(5.0)
    flight.arm()
    armed = observed.simulation.time
    observed.fly(15.0)
    m = observed.sent("FLIGHT_INFORMATION")
    assert m.arming_time_utc == pytest.approx(armed * 1e6, abs=25_000)
    assert armed * 1e6 < m.takeoff_time_utc < m.time_boot_ms * 1e3
    assert (m.flight_uuid, m.landing_time) == (1, 0)
    took_off = m.takeoff_time_utc
    flight.land()
    while flight.armed:
        observed.fly(0.5)
        assert observed.simulation.time < 100.0
    m = observed.sent("FLIGHT_INFORMATION")
    assert m.takeoff_time_utc == took_off
    assert took_off * 1e-3 < m.landing_time <= m.time_boot_ms
    flight.arm()
    observed.fly(0.1)
    m = observed.sent("FLIGHT_INFORMATION")
    assert (m.flight_uuid, m.takeoff_time_utc, m.landing_time) == (2, 0, 0)


def test_a_flight_begun_in_the_air_is_the_first() -> None:
    observed = Observed(start="trim:20")
    m = observed.sent("FLIGHT_INFORMATION")
    assert (m.flight_uuid, m.arming_time_utc, m.takeoff_time_utc) == (1, 1, 1)  # zero would be never


def test_an_outside_controller_is_no_new_flight() -> None:
    observed = Observed(start="trim:20")
    observed.fly(0.1)
    observed.simulation.set_controls(observed.simulation.controls)
    observed.fly(0.1)
    observed.simulation.take_over()
    observed.fly(0.1)
    assert observed.sent("FLIGHT_INFORMATION").flight_uuid == 1


def test_fence_status_counts_breaches() -> None:
    observed = Observed(start="trim:20")
    observed.flight.parameters.set("GF_ACTION", 1)  # warn
    observed.fly(0.2)
    m = observed.sent("FENCE_STATUS")
    assert (m.breach_status, m.breach_count, m.breach_type, m.breach_time) == (0, 0, mav.FENCE_BREACH_NONE, 0)
    assert m.breach_mitigation == mav.FENCE_MITIGATE_NONE

    observed.flight.parameters.set("GF_MAX_VER_DIST", 50)  # it flies at 100 m
    observed.fly(0.2)
    m = observed.sent("FENCE_STATUS")
    assert (m.breach_status, m.breach_count, m.breach_type) == (1, 1, mav.FENCE_BREACH_MAXALT)
    assert 200 <= m.breach_time <= 400

    observed.flight.parameters.set("GF_MAX_VER_DIST", 0)
    observed.fly(0.2)
    m = observed.sent("FENCE_STATUS")
    assert (m.breach_status, m.breach_count, m.breach_type) == (0, 1, mav.FENCE_BREACH_MAXALT)  # the last one

    observed.flight.fence.load((), (FenceCircle(47.397742, 8.545594, 5000.0, inclusion=False),))
    observed.fly(0.2)
    m = observed.sent("FENCE_STATUS")
    assert (m.breach_status, m.breach_count, m.breach_type) == (1, 2, mav.FENCE_BREACH_BOUNDARY)


def test_a_restart_forgets() -> None:
    observed = Observed(start="trim:20")
    observed.fly(0.1)
    observed.simulation.restart("ground")
    observed.context.restarted()
    m = observed.sent("FLIGHT_INFORMATION")
    assert (m.flight_uuid, m.arming_time_utc) == (0, 0)
    assert observed.sent("GLOBAL_POSITION_INT").relative_alt == pytest.approx(280, abs=30)  # on its gear at home


def test_without_an_autopilot_there_is_no_record() -> None:
    observed = Observed(autopilot=False)
    assert observed.sent("FENCE_STATUS").breach_status == 0
    assert observed.sent("FLIGHT_INFORMATION").flight_uuid == 0
