"""Servo outputs of an outside controller over real UDP: claimed, released, and driving time in lockstep."""

import contextlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.face import RELEASE_SERVOS
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed
from vehicle_model.aircraft import Aircraft

Make = Callable[..., Any]


def test_our_own_words_come_back_and_claim_nothing(ground: Make) -> None:
    made = ground()
    echo = made.client(system=1, component=1)
    echo.send(mav.MAVLink_servo_output_raw_message(0, 0, *[1500] * 8))
    made.heard(made.client())  # what came before has been looked at
    assert made.face.servo_input.source is None


@pytest.mark.parametrize("kind", ["SERVO_OUTPUT_RAW", "HIL_ACTUATOR_CONTROLS", "HIL_CONTROLS"])
def test_servo_outputs_over_the_wire_reach_the_controls(ground: Make, kind: str) -> None:
    made = ground()
    client = made.client()
    client.send(
        {
            "SERVO_OUTPUT_RAW": mav.MAVLink_servo_output_raw_message(0, 0, 1500, 1500, *[0] * 6),
            "HIL_ACTUATOR_CONTROLS": mav.MAVLink_hil_actuator_controls_message(0, [0.5, 0.5] + [0.0] * 14, 129, 0),
            "HIL_CONTROLS": mav.MAVLink_hil_controls_message(0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 129, 0),
        }[kind]
    )
    made.until(lambda: made.face.servo_input.source)
    assert made.face.servo_input.source[:2] == (255, 190)
    assert made.face.servo_input.controls[:2].tolist() == pytest.approx([0.5, 0.5])
    made.until(lambda: client.of("STATUSTEXT"))
    assert client.of("STATUSTEXT")[0].text.startswith("Servos taken by 255/190 on udpin:")


@pytest.mark.parametrize("streams", ["normal", "onboard"])
def test_two_vehicles_behind_one_router_leave_each_other_alone(
    ground: Make, streams: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A client of both passes on, from the very first datagram, all that each of them says."""
    monkeypatch.setattr("sitl.mavlink.links.ONBOARD_PORTS", range(1 << 16) if streams == "onboard" else ())
    one, other = ground(system_id=1), ground(system_id=2)
    ends = one.heard(one.client()), other.heard(other.client())
    for tick in range(400):
        for made in (one, other):
            made.wall = tick / 400
            made.face.publish(made.at(tick / 400), made.wall)
        for end, opposite in (ends, ends[::-1]):
            with contextlib.suppress(BlockingIOError):
                while True:
                    data = end.socket.recv(65536)
                    opposite.socket.send(data)
                    end.received += end.mav.parse_buffer(data) or []
        one.face.receive(one.wall)
        other.face.receive(other.wall)
    for made, end in zip((one, other), ends, strict=True):
        assert end.of("SERVO_OUTPUT_RAW")
        assert made.face.servo_input.source is None
    one.until(lambda: one.face.servo_input.ignored == len(ends[1].of("SERVO_OUTPUT_RAW")))
    assert one.face.servo_input.source is None


@pytest.mark.parametrize(
    ("kind", "attitude"), [("HIL_STATE", [0.0] * 3), ("HIL_STATE_QUATERNION", [[1.0, 0.0, 0.0, 0.0]])]
)
def test_who_tells_a_true_state_makes_no_claim_by_its_servo_telemetry(
    ground: Make, kind: str, attitude: list[Any]
) -> None:
    made = ground()
    vehicle = made.client(system=7, component=1)
    message = getattr(mav, f"MAVLink_{kind.lower()}_message")
    rest = [0] * (len(message.fieldnames) - 1 - len(attitude))
    vehicle.send(message(0, *attitude, *rest))
    vehicle.send(mav.MAVLink_servo_output_raw_message(0, 0, *[1500] * 8))
    made.until(lambda: made.face.servo_input.ignored)
    assert made.face.servo_input.source is None


def test_servos_are_released_by_command_of_the_holder_only(ground: Make) -> None:
    made = ground()
    holder, other = made.heard(made.client()), made.heard(made.client(system=250))
    holder.send(mav.MAVLink_hil_actuator_controls_message(0, [0.5] * 16, 129, 0))
    made.until(lambda: made.face.servo_input.source)
    assert made.acknowledged(other, RELEASE_SERVOS).result == mav.MAV_RESULT_DENIED
    assert made.acknowledged(holder, RELEASE_SERVOS).result == mav.MAV_RESULT_ACCEPTED
    assert made.face.servo_input.source is None


def test_lockstep_answers_each_tick_once_with_state_and_sensors_of_one_time(ground: Make) -> None:
    made = ground(lockstep=True)
    client = made.client()
    now_us = 0
    for number in range(50):
        for repeated in (False, True) if number % 7 == 0 else (False,):
            client.received.clear()
            client.send(mav.MAVLink_hil_actuator_controls_message(2500 * number, [0.1] * 16, 129, 1))
            ticks: list[bool] = []

            def tick_or_repeat(seen: list[bool] = ticks) -> list[bool]:
                if made.face.servo_input.take_tick():
                    seen.append(True)
                elif made.face.servo_input.take_repeat():
                    seen.append(False)
                return seen

            made.until(tick_or_repeat)
            assert ticks == [not repeated]
            now_us += 2500 * ticks[0]
            made.face.answer(made.at(now_us * 1e-6), made.wall)
            made.until(lambda: client.of("HIL_SENSOR"))
            assert [message.time_usec for message in client.of("HIL_STATE_QUATERNION")] == [2500 * (number + 1)]
            assert [message.time_usec for message in client.of("HIL_SENSOR")] == [2500 * (number + 1)]


def test_servo_output_raw(moment: Callable[..., Snapshot], aircraft: Aircraft) -> None:
    observed = Observed()
    m = observed.sent("SERVO_OUTPUT_RAW", moment(time=5000.0))
    assert m.time_usec == 5_000_000_000 % 2**32
    assert m.port == 0
    tilt, aileron, _, elevator = aircraft.vehicle["servos"][0]

    def pulse(angle: float, servo: np.void) -> int:
        return round(1000.0 + 1000.0 * (angle - servo["minimum"]) / (servo["maximum"] - servo["minimum"]))

    assert [m.servo1_raw, m.servo2_raw, m.servo3_raw] == [1600, 1500, 1375]
    assert m.servo4_raw == pulse(math.radians(40.0), tilt)
    assert [m.servo5_raw, m.servo6_raw] == [pulse(0.10, aileron), pulse(-0.05, aileron)]
    assert m.servo7_raw == pulse(0.02, elevator)
    assert [getattr(m, f"servo{n}_raw") for n in range(8, 17)] == [0] * 9
