"""Who may move the servos, what each message means for the aircraft, and when a message is a tick."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.hil.servo_input import ServoInput, Source
from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.state import CONTROL_NAMES

ALICE = Source(255, 190, "udpin:14550")
BOB = Source(2, 1, "udpin:14550")
ZEROS = (0.0,) * 16
ARMED, DISARMED = 128 | 1, 1


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft()


def servos(aircraft: Aircraft, **options: object) -> tuple[ServoInput, list[str]]:
    said: list[str] = []
    return ServoInput(aircraft.channels, lambda _, text: said.append(text), **options), said  # type: ignore[arg-type]


def actuators(made: ServoInput, values: dict[str, float], source: Source = ALICE, **rest: float) -> None:
    controls = [0.0] * 16
    for name, value in values.items():
        controls[CONTROL_NAMES.index(name)] = (
            value  # the shipped aircraft has its channels in the order of the controls
        )
    made.hil_actuator_controls(
        int(rest.get("time_us", 0)), controls, int(rest.get("mode", ARMED)), source, rest.get("wall", 0.0)
    )


def controls_of(made: ServoInput) -> dict[str, float]:
    return dict(zip(CONTROL_NAMES, made.controls.tolist(), strict=True))


def test_normalised_values_are_throttles_and_angles_linear_over_the_servo_range(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft)
    actuators(made, {"throttle_left": 0.25, "throttle_tail": -0.5, "tilt": 1.0, "aileron_left": -1.0, "elevator": 0.5})
    tilt, aileron, _, elevator = aircraft.vehicle["servos"][0]
    assert controls_of(made) == pytest.approx(
        {
            "throttle_left": 0.25,
            "throttle_right": 0.0,
            "throttle_tail": -0.5,
            "tilt": tilt["maximum"],
            "aileron_left": aileron["minimum"],
            "aileron_right": (aileron["minimum"] + aileron["maximum"]) / 2,
            "elevator": elevator["minimum"] + 0.75 * (elevator["maximum"] - elevator["minimum"]),
        }
    )


def test_pulses_are_throttles_and_angles(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft)
    made.servo_output_raw(0, [1600, 1000, 1250, 2000, 1000, 1500, 1750, *[0] * 9], ALICE, 0.0)
    tilt, aileron, _, elevator = aircraft.vehicle["servos"][0]
    assert controls_of(made) == pytest.approx(
        {
            "throttle_left": 0.6,
            "throttle_right": 0.0,
            "throttle_tail": -0.5,
            "tilt": tilt["maximum"],
            "aileron_left": aileron["minimum"],
            "aileron_right": (aileron["minimum"] + aileron["maximum"]) / 2,
            "elevator": elevator["minimum"] + 0.75 * (elevator["maximum"] - elevator["minimum"]),
        }
    )


def test_channels_without_a_pulse_keep_what_the_vehicle_had(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft)
    trim = np.array([0.4, 0.41, 0.1, 0.5, 0.01, 0.02, 0.03])
    made.follow(trim)
    made.servo_output_raw(0, [1500, 0, 0xFFFF, 100, 60000, 0, 0, *[0] * 9], ALICE, 0.0)
    assert made.controls.tolist() == [0.5, *trim[1:]]
    assert made.rejected == 2


def test_auxiliary_ports_are_not_ours(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft)
    made.servo_output_raw(1, [2000] * 16, ALICE, 0.0)
    assert made.source is None


def test_hil_controls_move_what_their_names_say(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft)
    made.hil_controls((1.0, 1.0, 0.25, 0.5), -1.0, 0.3, ALICE, 0.0)
    tilt, left, right, elevator = aircraft.vehicle["servos"][0]
    assert controls_of(made) == pytest.approx(
        {
            "throttle_left": 0.75,  # more thrust left: nose right
            "throttle_right": 0.25,
            "throttle_tail": 0.3,
            "tilt": tilt["minimum"],
            "aileron_left": left["maximum"],  # trailing edge down: left wing up, roll right
            "aileron_right": right["minimum"],
            "elevator": elevator["minimum"],  # trailing edge up: nose up
        }
    )


@given(
    values=st.lists(st.floats(width=32), min_size=16, max_size=16),
    pulses=st.lists(st.integers(0, 65535), min_size=16, max_size=16),
)
def test_whatever_is_sent_the_controls_stay_in_range(values: list[float], pulses: list[int]) -> None:
    aircraft = load_aircraft()
    made, _ = servos(aircraft)
    limits = [(channel.index, channel.minimum, channel.maximum) for channel in aircraft.channels]
    made.follow(np.array([low for _, low, _ in limits]))
    for give in (
        lambda: made.hil_actuator_controls(0, values, ARMED, ALICE, 0.0),
        lambda: made.servo_output_raw(0, pulses, ALICE, 0.0),
        lambda: made.hil_controls((values[0], values[1], values[2], values[3]), values[4], values[5], ALICE, 0.0),
    ):
        give()
        for index, low, high in limits:
            assert low - 1e-12 <= made.controls[index] <= high + 1e-12


def test_values_that_are_no_number_are_rejected_and_values_out_of_range_limited(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft)
    actuators(made, {"throttle_left": 0.5, "throttle_right": 0.5})
    actuators(made, {"throttle_left": math.nan, "throttle_right": math.inf, "throttle_tail": -7.0})
    assert made.controls[:3].tolist() == [0.5, 0.5, -1.0]
    assert (made.rejected, made.limited) == (2, 1)


def test_a_disarmed_autopilot_stops_the_motors_and_leaves_the_servos(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft)
    actuators(made, {"throttle_left": 0.5, "throttle_tail": -0.2, "tilt": 1.0, "elevator": 0.4})
    before = controls_of(made)
    made.hil_actuator_controls(0, ZEROS, DISARMED, ALICE, 0.0)
    assert controls_of(made) == {**before, "throttle_left": 0.0, "throttle_right": 0.0, "throttle_tail": 0.0}


def test_a_sender_that_says_nothing_about_arming_is_obeyed(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft)
    actuators(made, {"throttle_left": 0.5}, mode=0)
    assert made.controls[0] == 0.5


def test_the_first_sender_holds_the_servos_and_the_pilot_is_told(aircraft: Aircraft) -> None:
    made, said = servos(aircraft)
    actuators(made, {"throttle_left": 0.5}, ALICE)
    actuators(made, {"throttle_left": 0.9}, BOB)
    actuators(made, {"throttle_left": 0.9}, ALICE._replace(link="tcpin:5760"))
    assert (made.source, made.controls[0]) == (ALICE, 0.5)
    assert (made.taken, made.ignored) == (1, 2)
    assert said == ["Servos taken by 255/190 on udpin:14550"]


def test_what_is_said_of_a_claim_fits_one_status_text_however_long_the_link(aircraft: Aircraft) -> None:
    made, said = servos(aircraft)
    link = "udpout:a-computer-with-a-long-name.example.org:14561,onboard"
    actuators(made, {}, Source(200, 191, link))
    assert said == ["Servos taken by 200/191 on udpout:14561"]
    assert len(said[0]) <= 50


def test_the_servo_telemetry_of_another_simulated_vehicle_is_no_claim(aircraft: Aircraft) -> None:
    made, said = servos(aircraft)
    made.simulated_vehicle(BOB.system)
    made.servo_output_raw(0, [1500] * 16, BOB, 0.0)
    assert (made.source, made.ignored, said) == (None, 1, [])
    made.servo_output_raw(0, [1500] * 16, ALICE, 0.0)  # an autopilot that tells no true state
    assert made.source == ALICE


def test_a_simulated_vehicle_named_by_hand_may_drive_by_its_telemetry(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft, system=BOB.system)
    made.simulated_vehicle(BOB.system)
    made.servo_output_raw(0, [1500] * 16, BOB, 0.0)
    assert made.source == BOB


def test_a_silent_holder_loses_the_servos_to_the_next_who_speaks(aircraft: Aircraft) -> None:
    made, said = servos(aircraft, timeout=0.5)
    actuators(made, {"throttle_left": 0.5}, ALICE, wall=10.0)
    actuators(made, {"throttle_left": 0.9}, BOB, wall=10.5)
    assert made.source == ALICE
    actuators(made, {"throttle_left": 0.9}, BOB, wall=10.51)
    assert (made.source, made.controls[0]) == (BOB, 0.9)
    assert len(said) == 2


def test_only_the_holder_can_release(aircraft: Aircraft) -> None:
    made, said = servos(aircraft)
    actuators(made, {"throttle_left": 0.5}, ALICE)
    assert not made.release(BOB)
    assert made.source == ALICE
    assert made.release(ALICE._replace(component=7))
    assert made.source is None
    assert said[-1] == "Servos released by system 255"
    actuators(made, {"throttle_left": 0.9}, BOB)
    assert made.source == BOB


def test_a_fixed_system_is_the_only_one_obeyed(aircraft: Aircraft) -> None:
    made, _ = servos(aircraft, system=2)
    actuators(made, {"throttle_left": 0.5}, ALICE)
    assert made.source is None
    actuators(made, {"throttle_left": 0.9}, BOB)
    assert made.source == BOB


@pytest.mark.parametrize(("speed", "wall"), [(1.0, 0.5), (10.0, 0.05), (0.1, 5.0)])
def test_silence_is_said_once_after_the_timeout_scaled_by_speed(aircraft: Aircraft, speed: float, wall: float) -> None:
    made, said = servos(aircraft, timeout=0.5, speed=speed)
    actuators(made, {"throttle_left": 0.5}, wall=100.0)
    made.watch(100.0 + 0.99 * wall)
    assert made.fresh(100.0 + 0.99 * wall)
    assert len(said) == 1
    for later in (1.01, 1.5, 9.0):
        made.watch(100.0 + later * wall)
        assert not made.fresh(100.0 + later * wall)
    assert said[1:] == ["No servo outputs for 0.5 s: last ones held"]
    assert made.controls[0] == 0.5
    actuators(made, {"throttle_left": 0.6}, wall=100.0 + 10.0 * wall)
    assert said[2:] == ["Servo outputs are back"]


def test_as_fast_as_possible_nothing_goes_stale(aircraft: Aircraft) -> None:
    made, said = servos(aircraft, speed=math.inf)
    actuators(made, {"throttle_left": 0.5}, wall=0.0)
    made.watch(1e6)
    assert made.fresh(1e6)
    assert len(said) == 1


class TestLockstep:
    """Ticks: a time is worth one step, and only one."""

    @staticmethod
    def ticks(made: ServoInput, *times: int, step: int = 2500) -> list[bool]:
        """Whether each of these times advanced the vehicle, which then stands one step later."""
        advanced = []
        for time_us in times:
            actuators(made, {"throttle_left": 0.5}, time_us=time_us)
            taken = made.take_tick()
            if taken:
                made.time_us += step
            advanced.append(taken)
            assert made.take_repeat() is not taken
        return advanced

    def test_the_time_of_the_present_state_is_a_tick(self, aircraft: Aircraft) -> None:
        made, _ = servos(aircraft, lockstep=True)
        assert self.ticks(made, 0, 2500, 5000) == [True, True, True]
        assert made.time_us == 7500

    def test_a_repeated_time_is_answered_and_never_advances_again(self, aircraft: Aircraft) -> None:
        made, _ = servos(aircraft, lockstep=True)
        assert self.ticks(made, 0, 0, 0, 2500, 2500, 0) == [True, False, False, True, False, False]

    def test_a_late_comer_is_told_the_time_and_goes_on_from_there(self, aircraft: Aircraft) -> None:
        made, _ = servos(aircraft, lockstep=True)
        made.time_us = 1_000_000
        assert self.ticks(made, 0, 0, 1_000_000, 1_002_500) == [False, False, True, True]

    def test_a_clock_that_names_the_time_to_reach_works_as_well(self, aircraft: Aircraft) -> None:
        made, _ = servos(aircraft, lockstep=True)
        assert self.ticks(made, 2500, 2500, 5000, 7500, 5000) == [True, False, True, True, False]

    @given(losses=st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60))
    def test_lost_messages_never_deadlock_nor_cost_a_step(self, losses: list[tuple[bool, bool]]) -> None:
        made, _ = servos(load_aircraft(), lockstep=True)
        known, steps = 0, 0
        for request_lost, answer_lost in [*losses, *[(False, False)] * 5]:
            if request_lost:
                continue  # the client hears nothing and sends the same again
            [advanced] = self.ticks(made, known)
            steps += advanced
            if not answer_lost:
                known = made.time_us
        assert made.time_us == steps * 2500
        assert steps >= 5

    def test_controls_sent_ahead_are_applied_in_their_turn(self, aircraft: Aircraft) -> None:
        made, _ = servos(aircraft, lockstep=True)
        for number in range(3):
            actuators(made, {"throttle_left": 0.1 * (number + 1)}, time_us=2500 * (number + 1))
        seen = []
        while made.take_tick():
            seen.append(made.controls[0])
        assert seen == pytest.approx([0.1, 0.2, 0.3])

    def test_another_controller_starts_with_a_clean_slate(self, aircraft: Aircraft) -> None:
        made, _ = servos(aircraft, lockstep=True)
        self.ticks(made, 2500, 5000)
        actuators(made, {}, BOB, time_us=made.time_us, wall=10.0)
        assert made.take_tick()

    def test_a_controller_that_starts_anew_and_counts_from_the_start_again_goes_on(self, aircraft: Aircraft) -> None:
        made, _ = servos(aircraft, lockstep=True, timeout=0.5)
        self.ticks(made, *range(2500, 100_001, 2500))
        stood = made.time_us
        advanced = []
        for time_us in (2500, 5000, 7500):
            actuators(made, {}, time_us=time_us, wall=10.0)
            advanced.append(made.take_tick())
        # Its first message is answered with the time, the others are ticks.
        assert advanced == [False, True, True]
        assert made.time_us == stood

    def test_a_holder_that_only_paused_and_repeats_itself_gets_no_second_step(self, aircraft: Aircraft) -> None:
        made, _ = servos(aircraft, lockstep=True, timeout=0.5)
        self.ticks(made, 2500, 5000)
        actuators(made, {}, time_us=5000, wall=10.0)
        assert not made.take_tick()
        assert made.take_repeat()

    def test_outputs_without_a_tick_claim_nothing_and_their_sender_is_told_once(self, aircraft: Aircraft) -> None:
        made, said = servos(aircraft, lockstep=True)
        for _ in range(3):
            made.servo_output_raw(0, [1500] * 16, ALICE, 0.0)
            made.hil_controls((0.0, 0.0, 0.0, 0.5), 0.0, 0.0, BOB, 0.0)
        assert (made.source, made.ignored) == (None, 6)
        assert said == ["Lockstep needs HIL_ACTUATOR_CONTROLS"]
        actuators(made, {"throttle_left": 0.5}, ALICE)
        assert made.take_tick()

    def test_silence_is_no_event(self, aircraft: Aircraft) -> None:
        made, said = servos(aircraft, lockstep=True)
        self.ticks(made, 0)
        made.watch(1e6)
        assert made.fresh(1e6)
        assert len(said) == 1
