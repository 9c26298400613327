"""What a flight's messages are turned into and judged by, against closed forms."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import common

from gcs_scripts.elevator_step import Timing
from gcs_scripts.step_response import Reference, compare, read_reference, response


def state(
    time_us: int, heading: float, pitch: float, velocity_ned: tuple[float, float, float], q: float = 0.0
) -> object:
    """HIL_STATE_QUATERNION with wings level; angles [rad], velocity [m/s] a multiple of 1 cm/s."""
    a, b = math.cos(heading / 2), math.sin(heading / 2)
    c, d = math.cos(pitch / 2), math.sin(pitch / 2)
    quaternion = [a * c, -b * d, a * d, b * c]  # turn by the heading about z, then by the pitch about y
    vx, vy, vz = (round(100 * v) for v in velocity_ned)
    return common.MAVLink_hil_state_quaternion_message(
        time_us, quaternion, 0.0, q, 0.0, 0, 0, 0, vx, vy, vz, 0, 0, 0, 0, 0
    )  # fmt: skip


@pytest.mark.parametrize("heading", [0.0, 0.7, math.pi / 2, -2.5, math.pi])
@pytest.mark.parametrize("pitch", [-0.4, 0.0, 0.3])
def test_velocities_are_turned_into_body_axes_and_into_the_initial_heading(heading: float, pitch: float) -> None:
    # Level flight at `speed` along the nose with a slip to the right and a climb.
    speed, slip, sink = 30.0, 2.0, -3.0
    north = speed * math.cos(heading) - slip * math.sin(heading)
    east = speed * math.sin(heading) + slip * math.cos(heading)
    flown = response(
        [
            state(5_000_000, heading, pitch, (north, east, sink)),
            state(5_002_500, heading, pitch, (north, east, sink), 0.1),
        ]
    )
    rounding = 0.0075  # half a centimetre per second in each of two components
    assert flown.time == pytest.approx([0.0, 0.0025])
    assert flown.theta == pytest.approx(math.degrees(pitch), abs=1e-9)
    assert flown.q == pytest.approx([0.0, math.degrees(0.1)])
    assert flown.u == pytest.approx(speed * math.cos(pitch) - sink * math.sin(pitch), abs=rounding)
    assert flown.w == pytest.approx(speed * math.sin(pitch) + sink * math.cos(pitch), abs=rounding)
    assert flown.ahead == pytest.approx(speed, abs=rounding)
    assert flown.across == pytest.approx(slip, abs=rounding)
    assert flown.down == pytest.approx(sink, abs=rounding)


@pytest.fixture
def reference(tmp_path: Path) -> Reference:
    """A made-up response of which everything is known: theta to 2 deg, q to -4 deg/s."""
    time = np.linspace(0.0, 5.0, 501)
    pulse = np.sin(np.pi * time / 5.0)
    content = {
        "time_s": time, "u_m_s": 30.0 + pulse, "w_m_s": pulse, "q_deg_s": -4.0 * pulse, "theta_deg": 1.0 + 2.0 * pulse,
        "velocity_north_m_s": 30.0 + pulse, "velocity_east_m_s": 0.1 * pulse, "velocity_down_m_s": -pulse,
    }  # fmt: skip
    head = {
        "step_time_s": 1.0, "rate_hz": 100, "altitude_msl_m": 0.0,
        "servo_outputs_before": [0.1, 0.2], "servo_outputs_after": [0.1, 0.3],
    }  # fmt: skip
    file = tmp_path / "reference.json"
    file.write_text(json.dumps(head | {key: values.tolist() for key, values in content.items()}))
    return read_reference(file)


@pytest.mark.parametrize(
    ("field", "limit"), [("theta", 0.02), ("q", 0.04), ("ahead", 0.01), ("across", 0.01), ("down", 0.01)]
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_one_percent_of_the_excursion_and_one_quantum_are_the_limits(
    reference: Reference, field: str, limit: float, sign: float
) -> None:
    for share, passes in ((0.98, True), (1.02, False)):
        values = getattr(reference, field).copy()
        values[321] += sign * share * limit
        judged = compare(replace(reference, **{field: values}), reference)
        (off,) = (d for d in judged if d.largest > 0.0)
        assert (off.time, off.largest, off.limit) == pytest.approx((3.21, share * limit, limit))
        assert off.passed == passes
        assert all(d.passed for d in judged if d is not off)


def test_a_flight_that_is_late_is_compared_at_the_time_it_has_and_not_by_its_place(reference: Reference) -> None:
    assert max(d.largest for d in compare(reference.shifted(0.0), reference)) == 0.0
    late = {d.name: d.largest for d in compare(reference.shifted(0.1), reference)}
    assert late["theta"] == pytest.approx(2.0 * math.sin(math.pi * 0.1 / 5.0), rel=0.01)


def test_timing_tells_speed_rate_and_the_one_arrival_that_was_late() -> None:
    simulated = 7.0 + np.arange(2001) / 400.0
    arrival = 100.0 + (simulated - 7.0) / 4.0
    arrival[1000] += 0.01
    timing = Timing(simulated, arrival, lost=3, delay=0.005)
    assert timing.speed == pytest.approx(4.0, rel=1e-5)
    assert timing.rate == pytest.approx(400.0)
    assert timing.jitter_max == pytest.approx(0.01, rel=0.01)
    assert timing.jitter_p99 < 1e-4
    assert str(timing).startswith("4 x real time, 400.0 states a second, 3 messages lost")
