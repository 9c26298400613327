"""Open Drone ID: https://mavlink.io/en/services/opendroneid.html and the fields' text in common.xml."""

import math
import re
from typing import Any

import pytest

from sitl.mavlink.dialect import tiltwing as mav
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk

UTC = 1.8e9  # of the desk at simulated time zero
UNIX_2019 = 1546300800
OPERATOR = {"operator_latitude": 473_000_000, "operator_longitude": -85_000_000, "operator_altitude_geo": 512.5}
SYSTEM = {
    **OPERATOR,
    "operator_location_type": mav.MAV_ODID_OPERATOR_LOCATION_TYPE_FIXED,
    "classification_type": mav.MAV_ODID_CLASSIFICATION_TYPE_EU,
    "area_count": 3,
    "area_radius": 200,
    "area_ceiling": 600.0,
    "area_floor": 480.0,
    "category_eu": mav.MAV_ODID_CATEGORY_EU_SPECIFIC,
    "class_eu": mav.MAV_ODID_CLASS_EU_CLASS_4,
    "timestamp": 1000,
}


def requested(desk: Desk, name: str) -> Any:
    """The message as it is sent on request, None if it is not."""
    before = len(desk.of(name))
    desk.command(mav.MAV_CMD_REQUEST_MESSAGE, getattr(mav, f"MAVLINK_MSG_ID_{name}"))
    sent = desk.of(name)[before:]
    return sent[-1] if sent else None


def fields_of(message: Any, names: Any) -> dict[str, Any]:
    return {name: getattr(message, name) for name in names}


def text(characters: Any) -> bytes:
    return bytes(characters).rstrip(b"\0")


def test_location_on_the_ground_says_where_it_is_and_when(desk: Desk) -> None:
    desk.advance(2.0)
    location = requested(desk, "OPEN_DRONE_ID_LOCATION")
    snapshot = desk.simulation.snapshot()
    assert (location.target_system, location.target_component, text(location.id_or_mac)) == (0, 0, b"")
    assert location.status == mav.MAV_ODID_STATUS_GROUND
    assert (location.latitude, location.longitude) == (473_977_420, 85_455_940)
    assert location.altitude_geodetic == pytest.approx(snapshot.height_ellipsoid, abs=1e-3)
    assert location.direction == 36100
    assert (location.speed_horizontal, location.speed_vertical) == (0, 0)
    assert location.timestamp == pytest.approx((UTC + 2.0) % 3600.0, abs=0.01)


def test_location_in_flight_says_where_it_goes_and_how_high_it_is() -> None:
    desk = Desk(Simulation(start="trim:20"))
    desk.advance(1.0)
    location, snapshot = requested(desk, "OPEN_DRONE_ID_LOCATION"), desk.simulation.snapshot()
    north, east, down = snapshot.velocity_ned
    assert location.status == mav.MAV_ODID_STATUS_AIRBORNE
    course = math.degrees(math.atan2(east, north)) % 360.0
    assert abs((location.direction / 100.0 - course + 180.0) % 360.0 - 180.0) <= 0.006
    assert 0 <= location.direction < 36000
    assert location.speed_horizontal == pytest.approx(math.hypot(north, east) * 100.0, abs=0.5)
    assert location.speed_vertical == pytest.approx(-down * 100.0, abs=0.5)
    assert location.height_reference == mav.MAV_ODID_HEIGHT_REF_OVER_TAKEOFF
    home = desk.simulation.flight.home.altitude
    assert location.height == pytest.approx(snapshot.altitude_msl - home, abs=1e-3)
    desk.close()


def test_termination_and_a_failsafe_in_flight_are_emergencies() -> None:
    desk = Desk(Simulation(start="trim:20"))
    desk.simulation.flight.terminate()
    assert requested(desk, "OPEN_DRONE_ID_LOCATION").status == mav.MAV_ODID_STATUS_EMERGENCY
    desk.close()
    desk = Desk(Simulation(start="trim:20", parameters={"COM_ACT_FAIL_ACT": 2}))
    desk.simulation.fail_servo("tilt")
    desk.simulation.flight.transition(False)
    desk.until(lambda: requested(desk, "OPEN_DRONE_ID_LOCATION").status == mav.MAV_ODID_STATUS_EMERGENCY)
    desk.close()


def test_the_serial_number_has_the_form_of_cta_2063_and_is_the_vehicles_own() -> None:
    serials: set[bytes] = set()
    for system in (1, 2, 1):
        desk = Desk(system_id=system)
        desk.send(
            "COMMAND_LONG",
            target_system=system,
            command=mav.MAV_CMD_REQUEST_MESSAGE,
            param1=mav.MAVLINK_MSG_ID_OPEN_DRONE_ID_BASIC_ID,
        )
        (basic,) = desk.of("OPEN_DRONE_ID_BASIC_ID")
        assert basic.id_type == mav.MAV_ODID_ID_TYPE_SERIAL_NUMBER
        assert basic.ua_type == mav.MAV_ODID_UA_TYPE_HYBRID_LIFT
        serial = text(basic.uas_id)
        # Maker without I and O, a hexadecimal digit for the length of the rest, and the rest.
        assert re.fullmatch(rb"[0-9A-HJ-NP-Z]{4}C[0-9A-HJ-NP-Z]{12}", serial)
        serials.add(serial)
        desk.close()
    assert len(serials) == 2


def test_until_a_ground_station_says_otherwise_the_operator_is_at_home(desk: Desk) -> None:
    system = requested(desk, "OPEN_DRONE_ID_SYSTEM")
    assert system.operator_location_type == mav.MAV_ODID_OPERATOR_LOCATION_TYPE_TAKEOFF
    assert (system.operator_latitude, system.operator_longitude) == (473_977_420, 85_455_940)
    assert system.operator_altitude_geo == pytest.approx(488.0)
    assert (system.area_count, system.area_radius, system.area_ceiling, system.area_floor) == (1, 0, -1000, -1000)
    assert system.timestamp == int(UTC) - UNIX_2019


def test_without_an_autopilot_the_operators_place_is_unknown() -> None:
    desk = Desk(Simulation(autopilot=False))
    system = requested(desk, "OPEN_DRONE_ID_SYSTEM")
    assert (system.operator_latitude, system.operator_longitude, system.operator_altitude_geo) == (0, 0, -1000)
    assert requested(desk, "OPEN_DRONE_ID_LOCATION").status == mav.MAV_ODID_STATUS_GROUND
    desk.close()


def test_what_a_ground_station_says_is_passed_on_as_it_came(desk: Desk) -> None:
    desk.send("OPEN_DRONE_ID_SYSTEM", **SYSTEM)
    assert fields_of(requested(desk, "OPEN_DRONE_ID_SYSTEM"), SYSTEM) == SYSTEM
    desk.send("OPEN_DRONE_ID_SYSTEM_UPDATE", **{**OPERATOR, "operator_latitude": 5}, timestamp=2000)
    expected = {**SYSTEM, "operator_latitude": 5, "timestamp": 2000}
    assert fields_of(requested(desk, "OPEN_DRONE_ID_SYSTEM"), SYSTEM) == expected
    desk.send("OPEN_DRONE_ID_OPERATOR_ID", operator_id_type=0, operator_id="FIN87astrdge12k8")
    assert requested(desk, "OPEN_DRONE_ID_OPERATOR_ID").operator_id == "FIN87astrdge12k8"
    desk.send("OPEN_DRONE_ID_SELF_ID", description_type=1, description="survey of a roof")
    self_id = requested(desk, "OPEN_DRONE_ID_SELF_ID")
    assert (self_id.description_type, self_id.description) == (1, "survey of a roof")
    desk.send("OPEN_DRONE_ID_BASIC_ID", id_type=2, ua_type=1, uas_id=list(b"D-1234"))
    basic = requested(desk, "OPEN_DRONE_ID_BASIC_ID")
    assert (basic.id_type, basic.ua_type, text(basic.uas_id)) == (2, 1, b"D-1234")


def test_an_update_alone_tells_where_the_operator_is(desk: Desk) -> None:
    desk.send("OPEN_DRONE_ID_SYSTEM_UPDATE", **OPERATOR, timestamp=2000)
    system = requested(desk, "OPEN_DRONE_ID_SYSTEM")
    assert fields_of(system, OPERATOR) == OPERATOR
    assert system.operator_location_type == mav.MAV_ODID_OPERATOR_LOCATION_TYPE_LIVE_GNSS
    assert system.area_count == 1


def test_what_nobody_has_told_is_not_sent_and_empty_ids_are_none(desk: Desk) -> None:
    own = text(requested(desk, "OPEN_DRONE_ID_BASIC_ID").uas_id)
    desk.send("OPEN_DRONE_ID_BASIC_ID")
    desk.send("OPEN_DRONE_ID_OPERATOR_ID")
    desk.send("OPEN_DRONE_ID_SELF_ID", description="")
    assert text(requested(desk, "OPEN_DRONE_ID_BASIC_ID").uas_id) == own
    assert requested(desk, "OPEN_DRONE_ID_OPERATOR_ID") is None
    assert requested(desk, "OPEN_DRONE_ID_SELF_ID") is None


@pytest.mark.parametrize(
    ("component", "fields"),
    [
        (mav.MAV_COMP_ID_ODID_TXRX_1, {}),
        (mav.MAV_COMP_ID_ODID_TXRX_3, {}),
        (190, {"id_or_mac": list(b"3065EC6FC458")}),
        (mav.MAV_COMP_ID_AUTOPILOT1, {"target_system": 0, "target_component": 0}),
    ],
)
def test_what_is_said_of_other_aircraft_is_not_taken_for_our_own(
    desk: Desk, component: int, fields: dict[str, Any]
) -> None:
    desk.join(system=7, component=component).send("OPEN_DRONE_ID_SYSTEM", **SYSTEM, **fields)
    assert requested(desk, "OPEN_DRONE_ID_SYSTEM").area_count == 1


@pytest.mark.parametrize("latitude", [900_000_001, -(1 << 31)])
def test_an_operator_off_the_map_is_at_an_unknown_place(desk: Desk, latitude: int) -> None:
    absurd = {**SYSTEM, "operator_latitude": latitude, "operator_altitude_geo": math.nan, "area_floor": math.inf}
    desk.send("OPEN_DRONE_ID_SYSTEM", **absurd)
    system = requested(desk, "OPEN_DRONE_ID_SYSTEM")
    assert (system.operator_latitude, system.operator_longitude, system.operator_altitude_geo) == (0, 0, -1000)
