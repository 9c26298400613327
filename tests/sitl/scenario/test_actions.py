"""What scenarios can do and wait for, each with the vehicle that it is done to."""

import math
from collections.abc import Callable

import pytest

from sitl import Scenario, Simulation
from sitl.flight.mode import Mode
from sitl.flight.refused import Refused
from sitl.flight.regime import Regime
from sitl.scenario import Step
from sitl.scenario.actions import FORMS, parse_action
from sitl.scenario.triggers import parse_trigger


@pytest.fixture
def hovering() -> Simulation:
    simulation = Simulation(start="trim:0")
    simulation.advance(0.1)
    return simulation


def do(simulation: Simulation, text: str) -> None:
    parse_action(text)(simulation)


@pytest.mark.parametrize(
    ("text", "mode"),
    [
        ("land", Mode.LAND),
        ("return", Mode.RETURN),
        ("hold", Mode.HOLD),
        ("terminate", Mode.TERMINATION),
        ("mode position", Mode.POSITION),
        ("orbit 0 0 40", Mode.ORBIT),
        ("velocity 1 0 -0.5", Mode.OFFBOARD),
        ("goto 5 5 -90", Mode.HOLD),
        ("heading 90", Mode.HOLD),
    ],
)
def test_commands_lead_to_the_mode_they_are_for(hovering: Simulation, text: str, mode: Mode) -> None:
    do(hovering, text)
    hovering.advance(0.1)
    assert hovering.flight.mode == mode


def test_commands_reach_the_flight_with_their_numbers(hovering: Simulation) -> None:
    do(hovering, "parameter MIS_TAKEOFF_ALT 33")
    assert hovering.flight.parameters["MIS_TAKEOFF_ALT"] == 33.0
    do(hovering, "goto 5 -4 -96 2")
    hovering.step(8)
    setpoint = hovering.flight.demand.record[0]
    assert setpoint["position_ned"] == pytest.approx((5.0, -4.0, -96.0))
    assert setpoint["speed"] == 2.0
    do(hovering, "altitude 97")
    hovering.step(8)
    assert setpoint["position_ned"][2] == pytest.approx(-97.0)
    do(hovering, "speed 1.5")
    hovering.step(8)
    assert setpoint["speed"] == 1.5
    do(hovering, "transition cruise")
    hovering.step(8)
    assert hovering.flight.regime == Regime.TO_CRUISE
    do(hovering, "wind 4 -3")
    hovering.step(8)
    assert hovering.snapshot().wind_ned == pytest.approx((4.0, -3.0, 0.0))
    do(hovering, "disarm force")
    assert not hovering.flight.armed


def test_fate_reaches_the_airframe(hovering: Simulation) -> None:
    vehicle = hovering.airframe.vehicle
    do(hovering, "fail motor right 0.2")
    assert vehicle["rotors"]["thrust_factor"][0, 1] == pytest.approx(0.8)
    do(hovering, "fail tilt")
    assert vehicle["servos"]["rate_limit"][0, 0] == 0.0
    do(hovering, "repair")
    assert vehicle["servos"]["rate_limit"][0, 0] > 0.0
    do(hovering, "fail elevator -3")
    assert vehicle["servos"]["minimum"][0, 3] == pytest.approx(math.radians(-3.0))
    do(hovering, "link ground_station up")
    hovering.advance(1.0)
    assert hovering.flight.links.ground_station == 0.0
    do(hovering, "link ground_station down")
    hovering.advance(1.0)
    assert hovering.flight.links.ground_station == pytest.approx(1.0, abs=0.021)


def test_what_the_flight_refuses_is_refused(hovering: Simulation) -> None:
    for text in ("mission start", "speed 90", "goto 0 0 50", "mode stabilized"):
        with pytest.raises(Refused):
            do(hovering, text)


def test_every_form_can_be_written_as_it_says() -> None:
    for form in FORMS:
        words = [place.strip("[]").split("|")[0] for place in form.split()]
        text = " ".join("0" if word.isupper() and word != "NAME" else word for word in words)
        parse_action(text.replace("NAME", "MIS_TAKEOFF_ALT").replace("ALT 0", "ALT 10"))


@pytest.mark.parametrize(
    ("text", "come_true"),
    [
        ("disarmed", lambda s: s.flight.disarm(force=True)),
        ("mode:land", lambda s: s.flight.land()),
        ("altitude:99", lambda s: s.flight.go_to(0.0, 0.0, -95.0)),
        ("altitude:101", lambda s: s.flight.go_to(0.0, 0.0, -105.0)),
        ("airspeed:3", lambda s: s.set_wind((5.0, 0.0, 0.0))),
    ],
)
def test_events_come_when_they_should_and_not_before(
    hovering: Simulation, text: str, come_true: Callable[[Simulation], None]
) -> None:
    watch = parse_trigger(text)(hovering)
    hovering.advance(1.0)
    assert not watch()
    come_true(hovering)
    assert hovering.run_until(lambda _: watch(), timeout=20.0)


def test_states_are_those_of_the_flight(hovering: Simulation) -> None:
    states = {name: parse_trigger(name)(hovering)() for name in ("armed", "airborne", "landed", "hover", "cruise")}
    assert states == {"armed": True, "airborne": True, "landed": False, "hover": True, "cruise": False}
    hovering.reset("ground")
    states = {name: parse_trigger(name)(hovering)() for name in ("armed", "airborne", "landed", "disarmed")}
    assert states == {"armed": False, "airborne": False, "landed": True, "disarmed": True}


def test_a_waypoint_counts_from_the_steps_turn_on(hovering: Simulation) -> None:
    hovering.items_reached.append(2)
    watch = parse_trigger("waypoint:2")(hovering)
    assert not watch()
    hovering.items_reached += [1, 2]
    assert watch()


def test_without_an_autopilot_commands_are_refused_and_fate_goes_on() -> None:
    steps = (
        Step("land", parse_action("land")),
        Step("hold", parse_action("hold"), trigger=parse_trigger("landed")),
        Step("wind", parse_action("wind 3 0")),
    )
    simulation = Simulation(Scenario(start="trim:25", steps=steps), autopilot=False)
    said: list[str] = []
    simulation.listener = lambda _, text: said.append(text)
    simulation.advance(0.1)
    assert said == [f"Scenario: {what!r} refused: the autopilot is off" for what in ("land", "hold")]
    assert simulation.snapshot().wind_ned == pytest.approx((3.0, 0.0, 0.0))
