"""Setpoints from outside: every frame, what masks leave out, and what a vehicle flies of them."""

import math
import random
from collections.abc import Iterator
from typing import Any

import pytest

from sitl.flight.mode import Mode
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import IDENTITIES
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk
from vehicle_model.rotation import quaternion_from_euler

OFFBOARD = (1, 6, 0)  # base mode, and PX4's main and sub mode
POSITION, VELOCITY, BOTH, ACCELERATION = 0xDF8, 0xDC7, 0xDC0, 0xC3F  # masks: what is left is asked for


@pytest.fixture
def hovering() -> Iterator[Desk]:
    """A vehicle that hovers 100 m above home, its nose to the east."""
    desk = Desk(Simulation(start="trim:0", home=(47.397742, 8.545594, 488.0, 90.0)))
    desk.advance(0.1)
    yield desk
    desk.close()


def stream(desk: Desk, seconds: float, name: str = "SET_POSITION_TARGET_LOCAL_NED", **fields: Any) -> None:
    """Send a setpoint at 20 Hz, and enter Offboard."""
    for turn in range(round(seconds * 20)):
        desk.send(name, **fields)
        if turn == 2 and desk.simulation.flight.mode != Mode.OFFBOARD:
            answer = desk.command(mav.MAV_CMD_DO_SET_MODE, *OFFBOARD)
            assert answer.result == mav.MAV_RESULT_ACCEPTED, desk.of("STATUSTEXT")[-1].text
        desk.advance(0.06 if turn % 2 else 0.04)


def test_offboard_needs_setpoints_first_and_ends_when_they_stop(hovering: Desk) -> None:
    assert hovering.command(mav.MAV_CMD_DO_SET_MODE, *OFFBOARD).result == mav.MAV_RESULT_TEMPORARILY_REJECTED
    stream(hovering, 1.0, coordinate_frame=1, type_mask=POSITION, z=-100.0)
    assert hovering.simulation.flight.mode == Mode.OFFBOARD
    hovering.advance(0.8)
    assert hovering.simulation.flight.mode == Mode.OFFBOARD
    hovering.advance(0.6)
    assert hovering.simulation.flight.mode != Mode.OFFBOARD


@pytest.mark.parametrize(
    ("frame", "position", "goal"),
    [
        (mav.MAV_FRAME_LOCAL_NED, (4.0, 7.0, -102.0), (4.0, 7.0, -102.0)),
        (mav.MAV_FRAME_BODY_NED, (4.0, 7.0, -102.0), (4.0, 7.0, -102.0)),  # as its definition has it for positions
    ],
)
def test_a_position_is_flown_to(
    hovering: Desk, frame: int, position: tuple[float, ...], goal: tuple[float, ...]
) -> None:
    x, y, z = position
    stream(hovering, 15.0, coordinate_frame=frame, type_mask=POSITION & ~0x400, x=x, y=y, z=z, yaw=0.5)
    view = hovering.simulation.flight.view
    assert (view.north, view.east, view.down) == pytest.approx(goal, abs=0.5)
    assert view.yaw == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize(
    ("frame", "offset"),
    [
        (mav.MAV_FRAME_LOCAL_OFFSET_NED, (3.0, 1.0)),
        (mav.MAV_FRAME_BODY_OFFSET_NED, (-1.0, 3.0)),  # the nose points east
        (mav.MAV_FRAME_BODY_FRD, (-1.0, 3.0)),
    ],
)
def test_offsets_count_from_the_vehicle_and_along_its_nose(
    hovering: Desk, frame: int, offset: tuple[float, float]
) -> None:
    begun = hovering.simulation.flight.view.north, hovering.simulation.flight.view.east
    hovering.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=frame, type_mask=POSITION, x=3.0, y=1.0, z=0.0)
    hovering.advance(0.04)
    hovering.command(mav.MAV_CMD_DO_SET_MODE, *OFFBOARD)
    hovering.simulation.flight.links.enforced = False  # one setpoint is enough here
    hovering.advance(15.0)
    view = hovering.simulation.flight.view
    assert (view.north - begun[0], view.east - begun[1]) == pytest.approx(offset, abs=0.5)


@pytest.mark.parametrize(
    ("frame", "velocity"),
    [(mav.MAV_FRAME_LOCAL_NED, (2.0, 1.0)), (mav.MAV_FRAME_BODY_NED, (-1.0, 2.0))],
)
def test_a_velocity_is_kept(hovering: Desk, frame: int, velocity: tuple[float, float]) -> None:
    stream(hovering, 8.0, coordinate_frame=frame, type_mask=VELOCITY & ~0x800, vx=2.0, vy=1.0, vz=-0.5)
    view = hovering.simulation.flight.view
    assert (view.vn, view.ve, view.vd) == pytest.approx((*velocity, -0.5), abs=0.3)


def test_a_moving_point_is_followed(hovering: Desk) -> None:
    for turn in range(300):
        seconds = turn * 0.05
        hovering.send(
            "SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=1, type_mask=BOTH, x=1.5 * seconds, vx=1.5, z=-100.0
        )
        if turn == 2:
            hovering.command(mav.MAV_CMD_DO_SET_MODE, *OFFBOARD)
        hovering.advance(0.06 if turn % 2 else 0.04)
    view = hovering.simulation.flight.view
    assert view.north == pytest.approx(1.5 * 15.0, abs=0.7)
    assert view.vn == pytest.approx(1.5, abs=0.2)


def test_an_acceleration_is_flown(hovering: Desk) -> None:
    stream(hovering, 3.0, coordinate_frame=1, type_mask=ACCELERATION, afx=0.5, afy=0.0, afz=0.0)
    view = hovering.simulation.flight.view
    assert 0.5 < view.vn < 2.5
    assert abs(view.vd) < 0.3


@pytest.mark.parametrize(("frame", "altitude"), [(5, 593.0), (6, 105.0), (11, 105.0), (0, 593.0), (3, 105.0)])
def test_a_place_on_the_map_is_flown_to(hovering: Desk, frame: int, altitude: float) -> None:
    latitude, longitude, _ = hovering.simulation.flight.places.to_geodetic(6.0, 2.0, 0.0)
    stream(
        hovering, 15.0, "SET_POSITION_TARGET_GLOBAL_INT", coordinate_frame=frame, type_mask=POSITION,
        lat_int=round(latitude * 1e7), lon_int=round(longitude * 1e7), alt=altitude,
    )  # fmt: skip
    view = hovering.simulation.flight.view
    assert (view.north, view.east, view.down) == pytest.approx((6.0, 2.0, -105.0), abs=0.6)


def test_an_attitude_with_its_heading_is_flown(hovering: Desk) -> None:
    thrust = hovering.simulation.flight.view.thrust
    q = quaternion_from_euler(0.0, 0.0, 0.8)
    stream(hovering, 4.0, "SET_ATTITUDE_TARGET", type_mask=0x07, q=q, thrust=thrust)
    view = hovering.simulation.flight.view
    assert view.yaw == pytest.approx(0.8, abs=0.1)
    assert (view.roll, view.pitch) == pytest.approx((0.0, 0.0), abs=0.05)


def test_body_rates_are_flown(hovering: Desk) -> None:
    thrust = hovering.simulation.flight.view.thrust
    stream(hovering, 1.0, "SET_ATTITUDE_TARGET", type_mask=0x80, body_roll_rate=0.1, body_yaw_rate=0.3, thrust=thrust)
    view = hovering.simulation.flight.view
    assert view.roll == pytest.approx(0.09, abs=0.04)
    assert view.r == pytest.approx(0.3, abs=0.1)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"coordinate_frame": 1, "type_mask": POSITION, "x": math.nan}, "finite"),
        ({"coordinate_frame": 1, "type_mask": POSITION | 0x001}, "both or none of x and y"),
        ({"coordinate_frame": 99, "type_mask": POSITION}, "expected a frame of"),
        ({"coordinate_frame": 1, "type_mask": ACCELERATION | 0x200}, "got forces"),
    ],
)
def test_what_is_no_setpoint_is_said_once_and_changes_nothing(hovering: Desk, fields: Any, said: str) -> None:
    for _ in range(20):
        hovering.send("SET_POSITION_TARGET_LOCAL_NED", **fields)
    assert len(hovering.texts) == 1
    assert said in hovering.texts[0]
    assert hovering.simulation.flight.mode == Mode.HOLD


def test_any_numbers_whatever_leave_the_vehicle_flying(hovering: Desk) -> None:
    numbers = random.Random(5)
    stream(hovering, 0.5, coordinate_frame=1, type_mask=POSITION, z=-100.0)
    special = [math.nan, math.inf, -math.inf, 1e30, -1e30, 0.0, 1.0, -1.0, 5.0]
    for _ in range(1500):
        hovering.send(
            "SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=numbers.randrange(30), type_mask=numbers.randrange(65536),
            **{name: numbers.choice(special) for name in ("x", "y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw")},
        )  # fmt: skip
        hovering.send(
            "SET_ATTITUDE_TARGET", type_mask=numbers.randrange(256), q=[numbers.choice(special) for _ in range(4)],
            body_roll_rate=numbers.choice(special), body_yaw_rate=numbers.choice(special),
            thrust=numbers.choice(special),
        )  # fmt: skip
        hovering.send(
            "SET_POSITION_TARGET_GLOBAL_INT", coordinate_frame=numbers.randrange(30),
            type_mask=numbers.randrange(65536),
            lat_int=numbers.randrange(-(2**31), 2**31), lon_int=numbers.randrange(-(2**31), 2**31),
            alt=numbers.choice(special), vz=numbers.choice(special),
        )  # fmt: skip
    assert hovering.face.internal_errors == 0
    hovering.advance(0.5)
    assert all(math.isfinite(value) for value in hovering.simulation.state)


@pytest.fixture
def guided() -> Iterator[Desk]:
    """A vehicle that looks like ArduPilot and hovers in Guided, its nose to the east."""
    desk = Desk(Simulation(start="trim:0", home=(47.397742, 8.545594, 488.0, 90.0)), identity=IDENTITIES["ardupilot"])
    desk.advance(0.1)
    assert desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 15).result == mav.MAV_RESULT_ACCEPTED
    yield desk
    desk.close()


def test_in_guided_one_position_is_enough_to_go_there(guided: Desk) -> None:
    guided.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=1, type_mask=POSITION, x=9.0, y=-6.0, z=-104.0)
    guided.advance(25.0)
    view = guided.simulation.flight.view
    assert (view.north, view.east, view.down) == pytest.approx((9.0, -6.0, -104.0), abs=0.6)
    assert guided.texts == []


def test_qgroundcontrols_change_of_altitude_is_flown(guided: Desk) -> None:
    """Its firmware plugin sends 0xFFF8, all bits set but those of the position: no acceleration, and no force."""
    guided.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=7, type_mask=0xFFF8, z=-12.0)
    guided.advance(20.0)
    assert guided.simulation.flight.height == pytest.approx(112.0, abs=0.6)


def test_wing_borne_a_change_of_altitude_leaves_the_circle_where_it_is() -> None:
    desk = Desk(Simulation(start="trim:20"), identity=IDENTITIES["ardupilot"])
    desk.advance(0.1)
    desk.command(mav.MAV_CMD_DO_SET_MODE, 1, 15)
    desk.advance(10.0)
    centre = desk.face.context.guidance.place[:2]
    desk.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=7, type_mask=0xFFF8, z=-12.0)
    desk.advance(25.0)
    assert desk.face.context.guidance.place[:2] == centre
    assert desk.simulation.flight.height == pytest.approx(112.0, abs=1.5)
    desk.close()


def test_mavproxys_guided_forward_goes_along_the_nose(guided: Desk) -> None:
    begun = guided.simulation.flight.view.east
    guided.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=8, type_mask=0b10111111000, x=15.0)
    guided.advance(20.0)
    assert guided.simulation.flight.view.east - begun == pytest.approx(15.0, abs=0.6)


def test_in_guided_a_velocity_ends_when_it_is_not_repeated(guided: Desk) -> None:
    guided.send("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=1, type_mask=VELOCITY, vx=3.0)
    guided.advance(0.5)
    assert guided.simulation.flight.mode == Mode.OFFBOARD
    guided.advance(8.0)
    assert guided.simulation.flight.mode == Mode.HOLD
    assert abs(guided.simulation.flight.view.vn) < 0.3


def test_local_positions_count_from_the_local_origin(hovering: Desk) -> None:
    places = hovering.simulation.flight.places
    latitude, longitude, _ = places.to_geodetic(100.0, 50.0, 0.0)
    hovering.face.context.origin.put(round(latitude * 1e7), round(longitude * 1e7), 478000, places)
    stream(hovering, 15.0, coordinate_frame=1, type_mask=POSITION, x=-96.0, y=-43.0, z=-112.0)
    view = hovering.simulation.flight.view
    assert (view.north, view.east, view.down) == pytest.approx((4.0, 7.0, -102.0), abs=0.6)
    hovering.received.clear()
    hovering.command(mav.MAV_CMD_REQUEST_MESSAGE, mav.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED)
    [target] = hovering.of("POSITION_TARGET_LOCAL_NED")[-1:]
    assert (target.x, target.y, target.z) == pytest.approx((-96.0, -43.0, -112.0), abs=0.02)
