"""Time, regime, landed state and the angle of the wing, computed a second time from the definitions."""

import math
from collections.abc import Callable

import pytest

from sitl.flight.landed import LandedState
from sitl.flight.regime import Regime
from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import EPOCH, Observed
from vehicle_model.aircraft import Aircraft
from vehicle_model.state import blank_controls

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


@pytest.mark.parametrize("regime", Regime)
@pytest.mark.parametrize("landed", LandedState)
def test_the_autopilots_regime_and_landed_state_go_before_wing_and_gear(
    moment: Moment, observed: Observed, regime: Regime, landed: LandedState
) -> None:
    snapshot = moment(tilt=0.0, on_ground=True, regime=regime.name, landed=landed.name)
    m = observed.sent("EXTENDED_SYS_STATE", snapshot)
    vtol, land = mav.enums["MAV_VTOL_STATE"], mav.enums["MAV_LANDED_STATE"]
    words = {"HOVER": "MC", "CRUISE": "FW", "TO_CRUISE": "TRANSITION_TO_FW", "TO_HOVER": "TRANSITION_TO_MC"}
    assert vtol[m.vtol_state].name == f"MAV_VTOL_STATE_{words[regime.name]}"
    assert land[m.landed_state].name == f"MAV_LANDED_STATE_{landed.name}"


def test_system_time_is_utc_and_time_since_start(moment: Moment, observed: Observed) -> None:
    m = observed.sent("SYSTEM_TIME", moment())
    assert (m.time_unix_usec, m.time_boot_ms) == (round((EPOCH + 12.3475) * 1e6), 12348)


@pytest.mark.parametrize(
    ("tilt", "command", "state"),
    [
        (90.0, 90.0, mav.MAV_VTOL_STATE_MC),
        (76.0, 0.0, mav.MAV_VTOL_STATE_MC),
        (14.0, 90.0, mav.MAV_VTOL_STATE_FW),
        (50.0, 20.0, mav.MAV_VTOL_STATE_TRANSITION_TO_FW),
        (50.0, 90.0, mav.MAV_VTOL_STATE_TRANSITION_TO_MC),
    ],
)
def test_vtol_state_follows_the_wing(
    moment: Moment, observed: Observed, tilt: float, command: float, state: int
) -> None:
    controls = blank_controls()
    controls[3] = math.radians(command)
    snapshot = moment(tilt=math.radians(tilt), controls=controls)
    assert observed.sent("EXTENDED_SYS_STATE", snapshot).vtol_state == state


def test_a_wing_that_rests_half_way_keeps_the_direction_it_came_from(moment: Moment, observed: Observed) -> None:
    controls = blank_controls()
    controls[3] = math.radians(50.0)
    observed.context.note(moment(tilt=math.radians(30.0), controls=controls))
    resting = moment(tilt=math.radians(50.0), controls=controls)
    assert observed.sent("EXTENDED_SYS_STATE", resting).vtol_state == mav.MAV_VTOL_STATE_TRANSITION_TO_MC


@pytest.mark.parametrize(
    ("on_ground", "state"), [(True, mav.MAV_LANDED_STATE_ON_GROUND), (False, mav.MAV_LANDED_STATE_IN_AIR)]
)
def test_landed_state(moment: Moment, observed: Observed, on_ground: bool, state: int) -> None:
    assert observed.sent("EXTENDED_SYS_STATE", moment(on_ground=on_ground)).landed_state == state


def test_tilt_goes_out_in_degrees_for_everybody_and_in_radians_in_our_dialect(
    moment: Moment, observed: Observed
) -> None:
    named = observed.sent("NAMED_VALUE_FLOAT", moment())
    assert (named.name, named.time_boot_ms) == ("TILT", 12348)
    assert named.value == pytest.approx(42.0)
    ours = observed.sent("TILT_STATUS", moment())
    assert (ours.tilt, ours.tilt_command) == pytest.approx((math.radians(42.0), math.radians(40.0)))
    assert ours.tilt_rate_limit == pytest.approx(observed.context.tilt_rate_limit)
    assert ours.flags == 0


def test_tilt_status_says_what_holds_the_wing_back(moment: Moment, observed: Observed, aircraft: Aircraft) -> None:
    servo = aircraft.vehicle["servos"][0][0]
    threshold = servo["rate_limit"] * servo["time_constant"]  # lag at which a first-order servo asks for its top rate
    for lag, limited in ((0.9 * threshold, 0), (1.1 * threshold, mav.TILT_STATUS_FLAGS_RATE_LIMITED)):
        controls = blank_controls()
        controls[3] = 0.7
        assert observed.sent("TILT_STATUS", moment(tilt=0.7 - lag, controls=controls)).flags == limited
    controls = blank_controls()
    controls[3] = servo["maximum"] + 1.0
    at_end = moment(tilt=float(servo["maximum"]), controls=controls)
    assert observed.sent("TILT_STATUS", at_end).flags == mav.TILT_STATUS_FLAGS_AT_LIMIT
