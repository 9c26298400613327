"""Landing is felt without a switch, never in flight; take-off is noticed; landed vehicles are disarmed."""

import math
import random

import pytest

from sitl.flight.demand import Demand
from sitl.flight.landed import AutoDisarm, LandedDetector, LandedState
from sitl.flight.parameters import Parameters
from sitl.flight.view import View

PERIOD = 0.02
GRAVITY = 9.81
UPRIGHT = math.radians(90.0)
GROUND, AIR = LandedState.ON_GROUND, LandedState.IN_AIR
ORIGIN = (0.0, 0.0)


class Vehicle:
    """A mass over the ground at height 0 under a vertical speed law, as the detector sees one that hovers.

    `hover` is the share of thrust that carries it; a gust pushes with an acceleration down.
    """

    def __init__(self, height: float = 0.0, hover: float = 0.45) -> None:
        self.demand = Demand()
        self.detector = LandedDetector(Parameters())
        self.detector.begin(airborne=height > 0.0)
        self.view = View(down=-height, tilt=UPRIGHT, tilt_command=UPRIGHT, thrust=hover)
        self.hover = hover
        self.armed = True
        self.integral = 0.0
        self.reference = 0.0
        self.push = 0.0
        self.touched = False

    def fly(self, seconds: float) -> list[LandedState]:
        """States meanwhile."""
        states: list[LandedState] = []
        for _ in range(round(seconds / PERIOD)):
            states.append(self.detector.update(self.view, self.demand, self.armed))
            self._move()
        return states

    def settle_thrust(self) -> None:
        """Take the thrust away while in contact, as a landing does."""
        limit = float(self.demand.record[0]["thrust_limit"])
        self.demand.limit_thrust(max(limit - 0.02, 0.0) if self.detector.contact else 1.0)

    def _move(self) -> None:
        view, record = self.view, self.demand.record[0]
        if record["level"] != 4:
            view.thrust, wanted = 0.0, 0.0
        elif record["vertical"] == 1:
            wanted = float(record["velocity_ned"][2])
        else:
            error = float(record["position_ned"][2]) - view.down
            wanted = min(max(0.8 * error, -float(record["climb_rate"])), float(record["sink_rate"]))
        if record["level"] == 4:
            self.reference += min(max(wanted - self.reference, -2.0 * PERIOD), 2.0 * PERIOD)
            error = self.reference - view.vd
            self.integral = min(max(self.integral + 1.5 * error * PERIOD, -5.0), 8.0)
            asked = self.hover * (1.0 - min(2.5 * error + self.integral, 7.8) / GRAVITY)
            view.thrust += (min(max(asked, 0.0), float(record["thrust_limit"])) - view.thrust) * PERIOD / 0.1
        view.vd += (GRAVITY * (1.0 - view.thrust / self.hover) + self.push) * PERIOD
        view.down += view.vd * PERIOD
        if view.down >= 0.0:
            view.down, view.vd = 0.0, min(view.vd, 0.0)
            self.touched = True
        view.time += PERIOD


def test_stands_until_it_climbs() -> None:
    vehicle = Vehicle()
    vehicle.armed = False
    assert set(vehicle.fly(2.0)) == {GROUND}
    vehicle.armed = True
    vehicle.demand.idle()
    assert set(vehicle.fly(5.0)) == {GROUND}
    assert vehicle.detector.contact
    vehicle.demand.point((0.0, 0.0, -10.0), speed=5.0)
    states = vehicle.fly(6.0)
    assert states[-1] == AIR
    assert not vehicle.detector.contact
    assert states.index(AIR) * PERIOD < 1.5
    assert GROUND not in states[states.index(AIR) :]


def test_what_shakes_or_lifts_a_vehicle_that_does_not_fly_is_no_take_off() -> None:
    vehicle = Vehicle()
    for armed, level in ((False, vehicle.demand.off), (True, vehicle.demand.idle)):
        vehicle.armed = armed
        level()
        for down, vd in ((-1.0, -1.0), (-1.0, 0.0), (-0.5, 1.0)):
            vehicle.view.down, vehicle.view.vd = down, vd
            vehicle.view.time += PERIOD
            assert vehicle.detector.update(vehicle.view, vehicle.demand, armed) == GROUND


def test_a_bump_is_no_take_off() -> None:
    vehicle = Vehicle()
    vehicle.demand.velocity((0.0, 0.0, -0.01))
    vehicle.fly(1.0)
    vehicle.view.vd = -0.2
    assert vehicle.detector.update(vehicle.view, vehicle.demand, True) == GROUND
    vehicle.view.vd = 0.0
    assert set(vehicle.fly(1.0)) == {GROUND}


def test_names_take_off_and_landing_as_told() -> None:
    vehicle = Vehicle(height=5.0)
    demand, detector = vehicle.demand, vehicle.detector
    assert detector.update(vehicle.view, demand, True, taking_off=True) == LandedState.TAKEOFF
    assert detector.update(vehicle.view, demand, True, landing=True) == LandedState.LANDING
    assert detector.update(vehicle.view, demand, True) == AIR


@pytest.mark.parametrize("hover", [0.3, 0.45, 0.7])
@pytest.mark.parametrize("rate", [0.3, 0.4, 0.55, 1.0])
def test_a_landing_is_felt_within_a_second_and_ends(hover: float, rate: float) -> None:
    vehicle = Vehicle(height=6.0, hover=hover)
    vehicle.demand.point((0.0, 0.0, -6.0), speed=5.0)
    vehicle.fly(5.0)
    felt = landed = math.nan
    touched = math.nan
    while math.isnan(landed) and vehicle.view.time < 60.0:
        vehicle.demand.climb(rate)
        state = vehicle.fly(PERIOD)[0]
        vehicle.settle_thrust()
        if vehicle.touched and math.isnan(touched):
            touched = vehicle.view.time
        if vehicle.detector.contact and math.isnan(felt):
            felt = vehicle.view.time
        if state == GROUND:
            landed = vehicle.view.time
    assert 0.0 <= felt - touched < 1.0
    assert landed - touched < 2.0


def test_a_landing_is_felt_without_thrust_being_taken_away() -> None:
    """As where a pilot holds the stick down: the vertical speed law ends up at its lowest by itself."""
    vehicle = Vehicle(height=2.0)
    vehicle.demand.velocity((0.0, 0.0, 1.0))
    states = vehicle.fly(15.0)
    assert states[-1] == GROUND


def test_a_landing_is_felt_while_the_wind_pushes_the_vehicle_along() -> None:
    vehicle = Vehicle(height=2.0)
    vehicle.view.vn, vehicle.view.airspeed = 0.04, 10.0
    vehicle.view.q = 0.02
    vehicle.demand.velocity((0.0, 0.0, 0.4))
    states = vehicle.fly(25.0)
    assert states[-1] == GROUND


def test_a_landing_is_felt_against_a_wind_that_lays_the_wing_flat() -> None:
    vehicle = Vehicle(height=2.0)
    vehicle.view.tilt, vehicle.view.airspeed = math.radians(25.0), 10.0
    vehicle.demand.velocity((0.0, 0.0, 0.4))
    assert vehicle.fly(25.0)[-1] == GROUND


def test_a_rolling_touch_down_is_felt_if_the_vehicle_is_known_to_land() -> None:
    for landing in (True, False):
        vehicle = Vehicle(height=30.0)
        vehicle.demand.velocity((0.0, 0.0, 0.4))
        vehicle.fly(5.0)  # hover thrust is known
        vehicle.demand.velocity((8.0, 0.0, 0.4))
        view = vehicle.view
        view.vn, view.airspeed, view.vd, view.thrust = 8.0, 8.0, 0.0, 0.2
        for _ in range(100):
            view.time += PERIOD
            vehicle.detector.update(view, vehicle.demand, True, landing=landing)
        assert vehicle.detector.contact == landing


def test_slowing_down_above_the_height_asked_for_is_no_contact() -> None:
    vehicle = Vehicle(height=30.0)
    vehicle.demand.point((100.0, 0.0, -25.0), speed=5.0)
    view = vehicle.view
    view.vn, view.airspeed, view.vd, view.thrust = 8.0, 8.0, 0.0, 0.2
    for landing in (True, False):
        for _ in range(100):
            view.time += PERIOD
            vehicle.detector.update(view, vehicle.demand, True, landing=landing)
            assert not vehicle.detector.contact


def test_hover_thrust_is_learnt_from_hovering_and_from_steady_sinking() -> None:
    for rate in (0.0, 1.5):
        vehicle = Vehicle(height=30.0, hover=0.35)
        vehicle.demand.velocity((0.0, 0.0, rate))
        vehicle.fly(12.0)
        assert vehicle.detector.hover_thrust == pytest.approx(0.35, abs=0.02)
    vehicle = Vehicle(height=30.0, hover=0.35)
    vehicle.demand.point((0.0, 0.0, 0.0), speed=5.0)  # sinks at the limit on the way to a height
    vehicle.fly(10.0)
    assert vehicle.detector.hover_thrust == pytest.approx(0.35, abs=0.02)


def test_hover_in_gusts_that_stop_its_sinking_is_no_landing() -> None:
    draw = random.Random(3)
    for _ in range(20):
        vehicle = Vehicle(height=40.0)
        vehicle.demand.velocity((0.0, 0.0, 0.4))
        for _ in range(40):
            vehicle.push = draw.uniform(-1.0, 1.0)
            assert GROUND not in vehicle.fly(draw.uniform(0.2, 1.5))
            vehicle.settle_thrust()
        assert vehicle.view.down < 0.0


def test_a_mistaken_contact_is_given_up_as_soon_as_the_vehicle_sinks_again() -> None:
    vehicle = Vehicle(height=30.0)
    vehicle.demand.velocity((0.0, 0.0, 0.4))
    vehicle.fly(4.0)
    vehicle.detector.contact = True
    lowest = 1.0
    for _ in range(200):
        vehicle.demand.climb(0.4)
        vehicle.fly(PERIOD)
        vehicle.settle_thrust()
        lowest = min(lowest, vehicle.view.thrust)
    assert not vehicle.detector.contact
    assert vehicle.detector.state == AIR
    assert lowest > 0.0
    assert vehicle.view.vd == pytest.approx(0.4, abs=0.1)


@pytest.mark.parametrize("wind", [0.0, 14.9, 20.0])
def test_cruise_is_never_a_landing_even_against_the_wind_and_with_little_thrust(wind: float) -> None:
    vehicle = Vehicle(height=100.0)
    view = vehicle.view
    vehicle.demand.leg((0.0, 0.0, -100.0), (1000.0, 0.0, 0.0), speed=15.0, cruise=True)
    view.tilt, view.thrust = 0.15, 0.05
    view.airspeed, view.vn = max(15.0, wind), max(15.0, wind) - wind
    for _ in range(500):
        view.time += PERIOD
        assert vehicle.detector.update(view, vehicle.demand, True) == AIR
        assert not vehicle.detector.contact


def test_hover_waiting_at_a_height_is_no_landing() -> None:
    vehicle = Vehicle(height=10.0)
    vehicle.demand.point((0.0, 0.0, -10.0), speed=5.0)
    assert set(vehicle.fly(30.0)) == {AIR}
    assert not vehicle.detector.contact


def test_motors_stopped_in_the_air_land_where_the_fall_ends() -> None:
    vehicle = Vehicle(height=20.0)
    vehicle.demand.off()
    vehicle.armed = False
    states = vehicle.fly(5.0)
    fall = math.sqrt(2.0 * 20.0 / GRAVITY)
    assert states.index(GROUND) * PERIOD == pytest.approx(fall + 0.5, abs=0.2)


def test_a_pilot_lands_by_attitude_or_by_direct_throttle() -> None:
    for level in ("attitude", "direct"):
        vehicle = Vehicle(height=0.01)
        if level == "attitude":
            vehicle.demand.attitude(0.0, 0.0, 0.0, 0.0)
        else:
            vehicle.demand.direct([0.0] * 7)
            vehicle.view.tilt = 0.0
        assert vehicle.fly(2.0)[-1] == GROUND
        vehicle = Vehicle(height=10.0)
        if level == "attitude":
            vehicle.demand.attitude(0.0, 0.0, 0.0, 0.45)
        else:
            vehicle.demand.direct([0.5, 0.5, 0.0, UPRIGHT, 0.0, 0.0, 0.0])
        vehicle.view.vd = 0.0
        for _ in range(200):
            vehicle.view.time += PERIOD
            assert vehicle.detector.update(vehicle.view, vehicle.demand, True) == AIR


def disarm_time(states: list[tuple[float, LandedState]], **parameters: float) -> tuple[float, str] | None:
    """When a vehicle armed at 0 is disarmed, and why, its landed state being each of these from its time on."""
    disarm = AutoDisarm(Parameters(parameters))
    disarm.update(0.0, False, GROUND)
    for tick in range(1, 2000):
        time = tick * PERIOD
        state = [s for since, s in states if since <= time][-1]
        why = disarm.update(time, True, state)
        if why is not None:
            return time, why
    return None


def test_a_landed_vehicle_is_disarmed() -> None:
    flight = [(0.0, GROUND), (3.0, LandedState.TAKEOFF), (5.0, AIR), (9.0, LandedState.LANDING), (15.0, GROUND)]
    done = disarm_time(flight)
    assert done is not None
    assert done[0] == pytest.approx(16.5, abs=2.0 * PERIOD)
    assert done[1] == "landed"
    later = disarm_time(flight, COM_DISARM_LAND=5.0)
    assert later is not None
    assert later[0] == pytest.approx(20.0, abs=2.0 * PERIOD)


def test_a_vehicle_that_touches_the_ground_briefly_is_not_disarmed() -> None:
    flight = [(0.0, GROUND), (3.0, AIR), (10.0, GROUND), (11.5, AIR), (20.0, GROUND), (21.5, AIR)]
    assert disarm_time(flight) is None


def test_a_vehicle_armed_and_not_flown_is_disarmed() -> None:
    done = disarm_time([(0.0, GROUND)])
    assert done is not None
    assert done[0] == pytest.approx(10.0, abs=2.0 * PERIOD)
    assert done[1] == "no take-off within 10 s of arming"


@pytest.mark.parametrize("parameter", ["COM_DISARM_LAND", "COM_DISARM_PRFLT"])
def test_automatic_disarm_can_be_switched_off(parameter: str) -> None:
    flight = [(0.0, GROUND), (3.0, AIR), (10.0, GROUND)] if parameter == "COM_DISARM_LAND" else [(0.0, GROUND)]
    assert disarm_time(flight, **{parameter: -1.0}) is None
    assert disarm_time(flight, **{parameter: 0.0}) is None


def test_arming_again_counts_anew() -> None:
    disarm = AutoDisarm(Parameters())
    assert disarm.update(0.0, True, AIR) is None
    assert disarm.update(1.0, True, GROUND) is None
    assert disarm.update(3.1, True, GROUND) == "landed"
    assert disarm.update(3.2, False, GROUND) is None
    assert disarm.update(4.0, True, GROUND) is None
    assert disarm.update(13.0, True, GROUND) is None
    assert disarm.update(14.1, True, GROUND) == "no take-off within 10 s of arming"


def crashed_after(view: View, demand: Demand, detector: LandedDetector, seconds: float = 10.0) -> float | None:
    """When a vehicle that stays as in `view` is taken for down [s], None: not at all."""
    for tick in range(round(seconds / PERIOD)):
        view.time = tick * PERIOD
        if detector.update(view, demand, True) == GROUND:
            return view.time
    return None


@pytest.mark.parametrize(
    ("roll", "pitch", "tilt", "down"),
    [
        (175.0, 0.0, 54.0, True),
        (-80.0, 10.0, 90.0, True),
        (0.0, 85.0, 90.0, True),
        (0.0, -85.0, 60.0, True),
        (0.0, 80.0, 10.0, False),  # hangs on its propellers
        (0.0, -37.0, 118.0, False),
        (30.0, 0.0, 90.0, False),
    ],
)
def test_only_a_wreck_keeps_still_with_its_rotors_turned_from_up(
    roll: float, pitch: float, tilt: float, down: bool
) -> None:
    for wind in (0.0, 14.0):
        detector, demand = LandedDetector(Parameters()), Demand()
        detector.begin(airborne=True)
        demand.point((0.0, 0.0, -50.0), speed=5.0)
        view = View(down=-0.3, thrust=0.8, airspeed=wind, tilt=math.radians(tilt))
        view.roll, view.pitch = math.radians(roll), math.radians(pitch)
        after = crashed_after(view, demand, detector)
        assert after == (pytest.approx(3.0, abs=2.0 * PERIOD) if down else None)


def test_a_fallen_vehicle_that_pulls_in_vain_is_down_but_not_one_that_moves() -> None:
    for rate, thrust, speed, down in (
        (0.4, 0.9, 0.0, True),
        (0.4, 0.9, 3.0, False),
        (0.2, 0.9, 0.0, False),
        (-1.0, 0.9, 0.0, False),
    ):
        detector, demand = LandedDetector(Parameters()), Demand()
        detector.begin(airborne=True)
        demand.velocity((0.0, 0.0, rate))
        view = View(down=-0.3, thrust=thrust, vn=speed, roll=math.radians(40.0), tilt=UPRIGHT)
        assert (crashed_after(view, demand, detector) is not None) is down
