"""The vehicle in process: the same bits however it is driven, starts anywhere, scenarios, faults, outside control."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl import Scenario, Simulation
from sitl.flight.mode import Mode
from sitl.flight.plan_file import PlanError
from sitl.flight.refused import Refused
from sitl.flight.regime import Regime
from sitl.history import ROW
from sitl.scenario import Wind
from sitl.start import StartError
from vehicle_model.aircraft import load_aircraft
from vehicle_model.state import ROTOR_SPEED, TILT
from vehicle_model.wind import Gust

ROOT = Path(__file__).parents[2]
SURVEY = ROOT / "docs" / "examples" / "survey_3km.plan"
GUSTY = Scenario(
    start="trim:20",
    wind=Wind((3.0, -4.0, 0.0), roughness=0.05, gusts=(Gust(1.0, 50.0, (0.0, 2.0, -3.0)),)),
)


def commanded(fly: Callable[[Simulation, float], None]) -> bytes:
    """Bytes of a flight in gusts with commands at certain times, flown from one to the next as `fly` likes."""
    simulation = Simulation(GUSTY, seed=3)
    history = simulation.record(0.1)
    fly(simulation, 1.23)
    simulation.flight.transition(cruise=False)
    fly(simulation, 2.5)
    simulation.flight.go_to(50.0, 20.0, -80.0)
    fly(simulation, 2.0)
    return history.rows.tobytes() + simulation.state.tobytes()


def test_the_same_commands_give_the_same_bits_however_steps_are_grouped() -> None:
    def at_once(simulation: Simulation, seconds: float) -> None:
        simulation.advance(seconds)

    def one_by_one(simulation: Simulation, seconds: float) -> None:
        for _ in range(round(seconds * simulation.rate)):
            simulation.step()
            simulation.snapshot()

    def in_odd_groups(simulation: Simulation, seconds: float) -> None:
        end = simulation.tick + round(seconds * simulation.rate)
        while simulation.tick < end:
            simulation.step(min(13, end - simulation.tick))

    flown = commanded(at_once)
    assert commanded(at_once) == flown
    assert commanded(one_by_one) == flown
    assert commanded(in_odd_groups) == flown


def test_until_a_condition_holds_it_looks_after_every_update_and_gives_up_at_the_timeout() -> None:
    simulation = Simulation(start="trim:20")
    looked: list[int] = []

    def passed(simulation: Simulation) -> bool:
        looked.append(simulation.tick)
        return simulation.time >= 0.1

    assert simulation.run_until(passed, timeout=1.0)
    assert looked == [0, 8, 16, 24, 32, 40]
    simulation.step(3)
    assert not simulation.run_until(lambda s: s.time > 100.0, timeout=0.5)
    assert simulation.tick == 43 + 200


def test_a_reset_flies_as_a_new_simulation_does() -> None:
    used, new = Simulation(start="ground", wind=(2.0, 1.0, 0.0)), Simulation(start="trim:15", wind=(2.0, 1.0, 0.0))
    used.fail_motor("left", 0.3)
    used.set_wind((9.0, 0.0, 0.0))
    used.advance(2.0)
    used.reset("trim:15")
    assert (used.tick, used.time) == (0, 0.0)
    for simulation in (used, new):
        simulation.advance(3.0)
    assert used.state.tobytes() == new.state.tobytes()


@pytest.mark.parametrize(
    ("start", "armed", "regime"),
    [("ground", False, Regime.HOVER), ("trim:0", True, Regime.HOVER), ("trim:20", True, Regime.CRUISE)],
)
def test_it_begins_disarmed_on_the_ground_and_holding_in_the_air(start: str, armed: bool, regime: Regime) -> None:
    simulation = Simulation(start=start)
    assert (simulation.flight.armed, simulation.flight.mode, simulation.flight.regime) == (armed, Mode.HOLD, regime)
    seen = simulation.snapshot()
    assert (seen.armed, seen.mode, seen.regime) == (armed, "HOLD", regime.name)
    assert seen.landed == ("IN_AIR" if armed else "ON_GROUND")
    simulation.advance(5.0)
    later = simulation.snapshot()
    assert -later.position_ned[2] == pytest.approx(-seen.position_ned[2], abs=2.0)
    assert later.airspeed == pytest.approx(seen.airspeed, abs=2.0)


def test_a_state_is_a_start_with_servos_where_they_are() -> None:
    donor = Simulation(start="trim:20")
    donor.advance(4.0)
    state = donor.state
    simulation = Simulation(start="ground")
    simulation.reset(state)
    assert simulation.state == pytest.approx(state, abs=1e-12)
    assert simulation.controls[3:] == pytest.approx(state[TILT:], abs=1e-12)
    simulation.advance(2.0)
    assert simulation.snapshot().airspeed == pytest.approx(donor.snapshot().airspeed, abs=1.5)
    with pytest.raises(
        ValueError, match=r"start: expected a name, a file or a state of 20 numbers, got an array of \(3,\)"
    ):
        simulation.reset([1.0, 2.0, 3.0])


def test_without_an_autopilot_controls_are_held_and_commands_refused() -> None:
    simulation = Simulation(start="trim:25", autopilot=False)
    held = simulation.controls
    simulation.advance(1.0)
    assert simulation.controls.tobytes() == held.tobytes()
    with pytest.raises(Refused, match="the autopilot is off"):
        simulation.flight.land()
    seen = simulation.snapshot()
    assert (seen.armed, seen.mode, seen.landed, seen.regime, seen.battery_remaining) == (None,) * 5


def test_controls_from_outside_fly_until_the_autopilot_takes_over_again() -> None:
    simulation = Simulation(start="trim:20")
    simulation.advance(1.0)
    outside = simulation.controls
    simulation.set_controls(outside)
    assert simulation.is_flown_from_outside
    simulation.advance(1.0)
    assert simulation.controls.tobytes() == outside.tobytes()
    assert simulation.snapshot().mode is None
    simulation.take_over()
    simulation.advance(5.0)
    assert not simulation.is_flown_from_outside
    assert simulation.snapshot().mode == "HOLD"
    assert simulation.snapshot().airspeed == pytest.approx(20.0, abs=1.0)


def test_arguments_go_before_the_scenario() -> None:
    simulation = Simulation(
        Scenario(start="ground", parameters={"MIS_TAKEOFF_ALT": 50.0, "RTL_RETURN_ALT": 70.0}),
        start="trim:20",
        wind=(1.0, 2.0, 0.0),
        home=(10.0, 20.0, 30.0, 90.0),
        parameters={"MIS_TAKEOFF_ALT": 25.0},
    )
    seen = simulation.snapshot()
    assert (math.degrees(seen.latitude), math.degrees(seen.longitude)) == pytest.approx((10.0, 20.0), abs=1e-9)
    assert seen.altitude_msl == pytest.approx(130.0, abs=1e-6)
    assert math.degrees(seen.yaw) == pytest.approx(90.0)
    assert seen.wind_ned == pytest.approx((1.0, 2.0, 0.0))
    assert simulation.flight.parameters["MIS_TAKEOFF_ALT"] == 25.0
    assert simulation.flight.parameters["RTL_RETURN_ALT"] == 70.0
    with pytest.raises(ValueError, match="MIS_TAKEOFF_ALT: expected"):
        Simulation(parameters={"MIS_TAKEOFF_ALT": -1.0})
    for rate in (0, 20, 75, 333):
        with pytest.raises(ValueError, match=f"rate: expected a multiple of 50 steps per second, got {rate}"):
            Simulation(rate=rate)


def test_a_scenario_is_carried_out_in_its_order(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(
        """
        start = "trim:0"
        [[commands]]
        at = 0.5
        do = "goto 0 0 -104"
        [[commands]]
        when = "altitude:103"
        do = "wind 2 0"
        [[commands]]
        after = 0.5
        do = "fail motor tail 0.1"
        [[commands]]
        do = "mission start"
        [[commands]]
        do = "velocity 1 0 0"
        [[commands]]
        when = "mode:offboard"
        after = 4
        do = "hold"
        """
    )
    simulation = Simulation(file)
    said: list[str] = []
    simulation.listener = lambda _, text: said.append(text)
    assert simulation.run_until(lambda s: s.snapshot().wind_ned[0] == 2.0, timeout=20.0)
    assert -simulation.snapshot().position_ned[2] >= 103.0
    assert simulation.airframe.vehicle["rotors"]["thrust_factor"][0, 2] == 1.0
    assert simulation.run_until(lambda s: s.flight.mode == Mode.OFFBOARD, timeout=1.0)
    assert simulation.airframe.vehicle["rotors"]["thrust_factor"][0, 2] == pytest.approx(0.9)
    assert any("'mission start' refused: no mission" in text for text in said)
    simulation.advance(3.5)
    assert simulation.snapshot().velocity_ned[0] == pytest.approx(1.0, abs=0.3)
    assert simulation.run_until(lambda s: s.flight.mode == Mode.HOLD, timeout=2.0)


def test_history_has_a_row_for_every_interval_with_what_the_snapshot_says() -> None:
    simulation = Simulation(start="trim:20", wind=(3.0, 1.0, 0.0))
    history = simulation.record(0.1)
    simulation.advance(1.0)
    rows, seen = history.rows, simulation.snapshot()
    assert rows.dtype == ROW
    assert rows["time"] == pytest.approx(np.arange(11) / 10)
    last = rows[-1]
    assert last["state"].tobytes() == seen.state.tobytes()
    assert last["controls"].tobytes() == seen.controls.tobytes()
    assert last["position_ned"] == pytest.approx(seen.position_ned, abs=1e-6)
    assert last["velocity_ned"] == pytest.approx(seen.velocity_ned)
    assert last["euler"] == pytest.approx((seen.roll, seen.pitch, seen.yaw))
    assert (last["airspeed"], last["tilt"]) == pytest.approx((seen.airspeed, seen.tilt))
    assert last["wind_ned"] == pytest.approx((3.0, 1.0, 0.0))
    wetted, outer = simulation.aircraft.wing_strips
    assert last["stall_margin_wetted"] == seen.outputs["stall_margin"][wetted].min()
    assert last["stall_margin_outer"] == seen.outputs["stall_margin"][outer].min()
    assert last["power"] == pytest.approx(seen.battery_voltage * seen.battery_current)
    assert 0.0 < last["battery_remaining"] < 1.0
    assert (last["armed"], last["mode"], last["regime"], last["contact"]) == (1, Mode.HOLD, Regime.CRUISE, 0)
    assert (last["mission_item"], last["cruise"], last["radius"]) == (
        -1,
        1,
        simulation.flight.parameters["NAV_LOITER_RAD"],
    )


def test_faults_are_the_airframes_and_end_with_a_repair() -> None:
    simulation = Simulation(start="trim:0")
    simulation.fail_servo("tilt", math.radians(60.0))
    simulation.fail_motor("right", 0.25)
    simulation.advance(4.0)
    assert math.degrees(simulation.state[TILT]) == pytest.approx(60.0, abs=0.5)
    assert simulation.airframe.vehicle["rotors"]["thrust_factor"][0].tolist() == [1.0, 0.75, 1.0]
    simulation.repair()
    assert simulation.airframe.vehicle["rotors"]["thrust_factor"][0].tolist() == [1.0, 1.0, 1.0]
    with pytest.raises(ValueError, match="motor: expected one of left, right, tail, got 'middle'"):
        simulation.fail_motor("middle", 0.1)
    with pytest.raises(ValueError, match="servo: expected one of tilt, aileron_left"):
        simulation.fail_servo("rudder")


def test_a_repaired_vehicle_may_be_flown_as_before() -> None:
    simulation = Simulation(start="trim:0")
    simulation.fail_servo("tilt", math.radians(60.0))
    assert simulation.run_until(lambda s: s.flight.mode == Mode.LAND, timeout=10.0)
    simulation.advance(1.0)
    simulation.flight.hold()
    with pytest.raises(Refused, match="tilt servo failed"):
        simulation.flight.transition(cruise=True)
    simulation.repair()
    assert simulation.flight.actuators.faults == ()
    simulation.flight.transition(cruise=True)
    assert simulation.run_until(lambda s: s.flight.regime == Regime.CRUISE, timeout=30.0)
    assert simulation.flight.actuators.faults == ()


@pytest.mark.parametrize("motor", ["left", "tail"])
def test_a_vehicle_that_has_crashed_stops_its_motors(motor: str) -> None:
    simulation = Simulation(start="trim:0")
    simulation.flight.go_to(0.0, 0.0, -20.0)
    assert simulation.run_until(lambda s: -s.snapshot().position_ned[2] < 21.0, timeout=100.0)
    simulation.fail_motor(motor, 1.0)
    assert simulation.run_until(lambda s: s.snapshot().on_ground, timeout=30.0)
    assert simulation.run_until(lambda s: not s.flight.armed, timeout=8.0)
    assert simulation.flight.on_ground


def test_a_silent_ground_station_is_a_lost_link_in_simulated_time() -> None:
    simulation = Simulation(start="trim:0", parameters={"NAV_DLL_ACT": 3, "COM_DL_LOSS_T": 5})
    simulation.set_link("ground_station", up=True)
    simulation.advance(10.0)
    assert simulation.flight.mode == Mode.HOLD
    simulation.set_link("ground_station", up=False)
    simulation.advance(4.5)
    assert simulation.flight.links.ground_station == pytest.approx(4.5, abs=0.021)
    assert simulation.flight.mode == Mode.HOLD
    assert simulation.run_until(lambda s: s.flight.mode == Mode.LAND, timeout=10.0)
    with pytest.raises(ValueError, match="link: expected one of ground_station, manual_control, got 'radio'"):
        simulation.set_link("radio", up=True)


def test_a_plan_is_loaded_whole_or_not_at_all(tmp_path: Path) -> None:
    simulation = Simulation()
    simulation.load_plan(SURVEY)
    items = simulation.flight.mission.items
    assert len(items) > 4
    broken = tmp_path / "broken.plan"
    text = SURVEY.read_text()
    broken.write_text(text.replace('"command": 16', '"command": 9999', 1))
    with pytest.raises(PlanError) as refusal:
        simulation.load_plan(broken)
    assert str(refusal.value).startswith(f"{broken}: ")
    assert "\n" not in str(refusal.value)
    assert simulation.flight.mission.items == items


def test_control_laws_may_be_designed_for_another_aircraft_than_flies() -> None:
    nominal = load_aircraft()
    heavy = nominal.with_values({"mass_properties.mass": 1.08 * nominal.mass_properties.mass})
    simulation = Simulation(aircraft=heavy, design_aircraft=nominal, start="trim:0")
    simulation.advance(10.0)
    assert -simulation.snapshot().position_ned[2] == pytest.approx(100.0, abs=1.0)
    assert simulation.state[ROTOR_SPEED] > Simulation(start="trim:0").state[ROTOR_SPEED]


def test_a_restart_keeps_what_was_uploaded_and_begins_where_it_is_told() -> None:
    simulation = Simulation(start="trim:20", seed=3)
    simulation.flight.parameters.set("MIS_TAKEOFF_ALT", 31.0)
    simulation.load_plan("docs/examples/survey_3km.plan")
    items = simulation.flight.mission.items
    simulation.flight.links.enforced = False
    simulation.fail_motor("left", 0.2)
    simulation.advance(5.0)
    latitude, longitude, _ = simulation.flight.places.to_geodetic(150.0, 40.0, 0.0)
    simulation.restart("trim:25", heading=90.0, place=(latitude, longitude), height=60.0)
    flight, view = simulation.flight, simulation.flight.view
    assert (simulation.time, flight.parameters["MIS_TAKEOFF_ALT"], flight.mission.items) == (0.0, 31.0, items)
    assert not flight.links.enforced
    assert (view.north, view.east, flight.height) == pytest.approx((150.0, 40.0, 60.0), abs=0.1)
    assert "60 m above home" in simulation.description
    assert simulation.airframe.vehicle["rotors"]["thrust_factor"][0, 0] == 1.0
    simulation.restart()
    fresh = Simulation(start="trim:20", seed=3)
    assert (simulation.state == fresh.state).all()


@pytest.mark.parametrize(
    "how", [{"start": "trim:99"}, {"start": "ground", "place": (99.0, 8.0)}, {"start": "ground", "place": (48.9, 8.5)}]
)
def test_a_restart_that_cannot_be_changes_nothing(how: dict[str, Any]) -> None:
    simulation = Simulation(start="trim:20")
    simulation.advance(1.0)
    flight, state = simulation.flight, simulation.state
    with pytest.raises(StartError):
        simulation.restart(**how)
    assert simulation.flight is flight
    assert (simulation.state == state).all()
