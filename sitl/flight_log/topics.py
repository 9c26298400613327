"""What a flight log holds: its topics, named and laid out as PX4's where they mean the same.

https://docs.px4.io/main/en/msg_docs/. A field that PX4 has and this vehicle has nothing to say about is left out; ULog
describes itself, and readers look fields up by name. Ours alone are `tilt_status` and `airflow`. Everything is SI,
radians, body axes or NED of home; latitude and longitude are degrees, time stamps simulated microseconds.

On the right of a field stands what of MOMENT it shows, or a number that never changes. `timestamp` comes first in each
topic and goes without saying.
"""

import math
import re
from typing import NamedTuple

import numpy as np

from sitl.control.records import ESTIMATE
from sitl.flight_log.moment import MOMENT, MOTORS
from sitl.flight_log.ulog import data_header, field_size, format_definition, subscription

__all__ = ["DEFINITIONS", "QUICK", "ROW", "SLOW", "SUBSCRIPTIONS", "Row"]

# In every row.
QUICK = {
    "vehicle_attitude": ("uint64_t timestamp_sample = time", "float[4] q = quaternion"),
    "vehicle_angular_velocity": ("uint64_t timestamp_sample = time", "float[3] xyz = rates"),
    "vehicle_acceleration": ("uint64_t timestamp_sample = time", "float[3] xyz = specific_force"),
    "vehicle_local_position": (
        "uint64_t timestamp_sample = time", "uint64_t ref_timestamp = 0",
        "double ref_lat = origin_latitude", "double ref_lon = origin_longitude",
        "float x = north", "float y = east", "float z = down",
        "float vx = vn", "float vy = ve", "float vz = vd", "float z_deriv = vd",
        "float heading = heading", "float ref_alt = origin_altitude", "float eph = 0", "float epv = 0",
        "bool xy_valid = 1", "bool z_valid = 1", "bool v_xy_valid = 1", "bool v_z_valid = 1",
        "bool xy_global = 1", "bool z_global = 1", "bool heading_good_for_control = 1",
    ),
    "vehicle_global_position": (
        "uint64_t timestamp_sample = time", "double lat = latitude", "double lon = longitude", "float alt = altitude",
        "float alt_ellipsoid = altitude", "float vel_n = vn", "float vel_e = ve", "float vel_d = vd",
        "float eph = 0", "float epv = 0", "float terrain_alt = ground_altitude",
        "bool lat_lon_valid = 1", "bool alt_valid = 1", "bool terrain_alt_valid = 1",
    ),
    "vehicle_attitude_setpoint": (
        "float yaw_sp_move_rate = asked_yaw_rate", "float[4] q_d = asked_quaternion",
        "float[3] thrust_body = asked_thrust",
    ),
    "vehicle_local_position_setpoint": (
        "float x = asked_north", "float y = asked_east", "float z = asked_down",
        "float yaw = asked_heading", "float yawspeed = asked_yaw_rate",
        "float vx = asked_vn", "float vy = asked_ve", "float vz = asked_vd",
    ),
    # The left, right and tail motor.
    "actuator_motors": (
        "uint64_t timestamp_sample = time", "uint16_t reversible_flags = reversible", "float[12] control = motors",
    ),
    # The wing's tilt, the left and the right aileron, the elevator.
    "actuator_servos": ("uint64_t timestamp_sample = time", "float[8] control = servos"),
    "airspeed_validated": (
        "float indicated_airspeed_m_s = equivalent_airspeed", "float calibrated_airspeed_m_s = equivalent_airspeed",
        "float true_airspeed_m_s = airspeed", "int8_t airspeed_source = 1",
        "bool airspeed_sensor_measurement_valid = 1",
    ),
    "tilt_status": ("float tilt = tilt", "float tilt_command = tilt_command", "bool fault = tilt_fault"),
    "airflow": (
        "float[3] velocity_body = velocity_air", "float angle_of_attack = angle_of_attack", "float sideslip = sideslip",
    ),
}  # fmt: skip

# In every tenth row, and when the status changes.
SLOW = {
    "battery_status": (
        "float voltage_v = voltage", "float current_a = current", "float discharged_mah = discharged",
        "float remaining = remaining", "uint8_t cell_count = cells", "uint8_t id = 1", "bool connected = 1",
    ),
    "wind": (
        "uint64_t timestamp_sample = time", "float windspeed_north = wind_north", "float windspeed_east = wind_east",
        "float variance_north = 0", "float variance_east = 0",
    ),
    "vehicle_air_data": (
        "uint64_t timestamp_sample = time", "float baro_alt_meter = altitude", "float baro_pressure_pa = pressure",
        "float ambient_temperature = temperature", "float rho = density",
    ),
    # An ideal receiver.
    "vehicle_gps_position": (
        "uint64_t timestamp_sample = time", "uint64_t time_utc_usec = utc",
        "double latitude_deg = latitude", "double longitude_deg = longitude",
        "double altitude_msl_m = height", "double altitude_ellipsoid_m = height",
        "float eph = 0", "float epv = 0", "float hdop = 1", "float vdop = 1",
        "float vel_m_s = ground_speed", "float vel_n_m_s = vn", "float vel_e_m_s = ve", "float vel_d_m_s = vd",
        "float cog_rad = course", "bool vel_ned_valid = 1", "uint8_t fix_type = 3", "uint8_t satellites_used = 16",
    ),
    "esc_status": ("uint8_t esc_count = 3", "uint8_t esc_online_flags = 7", "uint8_t esc_armed_flags = turning"),
    "vehicle_status": (
        "uint64_t armed_time = armed_time", "uint64_t takeoff_time = takeoff_time",
        "uint64_t nav_state_timestamp = nav_state_time",
        "uint8_t arming_state = arming_state", "uint8_t nav_state = nav_state", "uint8_t vehicle_type = vehicle_type",
        "bool failsafe = failsafe", "bool is_vtol = 1", "bool is_vtol_tailsitter = 0",
        "bool in_transition_mode = in_transition", "bool in_transition_to_fw = in_transition_to_cruise",
        "uint8_t system_type = 24", "uint8_t system_id = system", "uint8_t component_id = 1", "uint8_t hil_state = 0",
    ),
    "vtol_vehicle_status": ("uint8_t vehicle_vtol_state = vtol_state", "bool fixed_wing_system_failure = tilt_fault"),
    "vehicle_land_detected": (
        "bool freefall = 0", "bool ground_contact = landed", "bool maybe_landed = landed", "bool landed = landed",
    ),
    "home_position": (
        "double lat = home_latitude", "double lon = home_longitude", "float alt = home_altitude",
        "float x = home_north", "float y = home_east", "float z = home_down",
        "bool valid_alt = 1", "bool valid_hpos = 1", "bool valid_lpos = 1",
    ),
    "mission_result": (
        "int32_t seq_reached = mission_reached", "uint16_t seq_current = mission_current",
        "uint16_t seq_total = mission_total", "bool valid = 1", "bool finished = mission_finished",
    ),
}  # fmt: skip

# One motor's controller: `esc_status` ends with one for each motor.
ESC_REPORT = (
    "int32_t esc_rpm = esc_rpm", "float esc_voltage = voltage", "float esc_current = esc_current",
    "uint8_t actuator_function = esc_function",
)  # fmt: skip

TIMESTAMP = "uint64_t timestamp = time"
FIRST_MOTOR = 101  # PX4's number of the output function Motor 1

_FIELD = re.compile(r"([\w\[\]]+) (\w+) = (\w+)")
_NUMPY = {
    "int8_t": "i1", "uint8_t": "u1", "bool": "u1", "uint16_t": "<u2", "int32_t": "<i4", "uint64_t": "<u8",
    "float": "<f4", "double": "<f8",
}  # fmt: skip


def _parts_of(record: np.dtype) -> "dict[str, tuple[np.dtype, int]]":
    """Type and place of each field of a record, by name."""
    return {name: (part[0], part[1]) for name, part in (record.fields or {}).items()}


_SOURCES = _parts_of(MOMENT)


class _Field(NamedTuple):
    """One field of a topic: where its bytes are in a MOMENT (`place`), or what they always are."""

    kind: str
    name: str
    content: bytes
    place: int | None


def _field(line: str, index: int = 0) -> _Field:
    """Read `type name = source`; `index` tells which element of an array to show where the field is but a number."""
    matched = _FIELD.fullmatch(line)
    assert matched is not None, line
    kind, name, source = matched.groups()
    basic, size = kind.partition("[")[0], field_size(kind)
    if source not in _SOURCES:
        return _Field(kind, name, np.array(float(source)).astype(_NUMPY[basic]).tobytes(), None)
    of_moment, place = _SOURCES[source]
    assert of_moment.base == np.dtype(_NUMPY[basic]), line
    return _Field(kind, name, bytes(size), place if of_moment.itemsize == size else place + index * size)


def _fields(topic: str, lines: tuple[str, ...]) -> list[_Field]:
    """All fields of a topic in the order of the log, with those of each motor's controller."""
    fields = [_field(line) for line in (TIMESTAMP, *lines)]
    if topic == "esc_status":
        fields += [_field(line, index) for index in range(MOTORS) for line in (TIMESTAMP, *ESC_REPORT)]
    return fields


def _definition(topic: str, lines: tuple[str, ...]) -> bytes:
    named = [(field.kind, field.name) for field in map(_field, (TIMESTAMP, *lines))]
    return format_definition(topic, [*named, (f"esc_report[{MOTORS}]", "esc")] if topic == "esc_status" else named)


def _layout(topics: dict[str, tuple[str, ...]], first: int) -> tuple[bytes, list[int | None]]:
    """The bytes of a row with these topics, their subscriptions counted from `first`, and where each comes from."""
    row, places = b"", list[int | None]()
    for number, (topic, lines) in enumerate(topics.items(), first):
        fields = _fields(topic, lines)
        content = b"".join(field.content for field in fields)
        header = data_header(number, len(content))
        row += header + content
        places += [None] * len(header)
        for field in fields:
            places += [None if field.place is None else field.place + i for i in range(len(field.content))]
    return row, places


_quick, _quick_places = _layout(QUICK, 0)
_slow, _slow_places = _layout(SLOW, len(QUICK))

# Of all topics: what they look like, and that they are logged under the numbers that rows use.
DEFINITIONS = b"".join(_definition(*topic) for topic in (*QUICK.items(), *SLOW.items(), ("esc_report", ESC_REPORT)))
SUBSCRIPTIONS = b"".join(subscription(number, topic) for number, topic in enumerate((*QUICK, *SLOW)))


_text, _places = _quick + _slow, (*_quick_places, *_slow_places)

# What `moment.fill_row` works with, in one record: each array handed to compiled code costs 0.1 us. `bytes` is
# the same memory as everything before it.
_parts = np.dtype(
    [
        ("moment", MOMENT, (1,)),
        ("estimate", ESTIMATE, (1,)),  # scratch
        ("places", np.int32, (len(_text),)),  # where among the bytes each one of the text comes from
        ("text", np.uint8, (len(_text),)),  # as it goes into the log: first the quick topics, then the slow ones
    ],
    align=True,
)
_inside = _parts_of(_parts)
ROW = np.dtype(
    {
        "names": [*_inside, "bytes"],
        "formats": [*(kind for kind, _ in _inside.values()), (np.uint8, (_parts.itemsize,))],
        "offsets": [*(place for _, place in _inside.values()), 0],
        "itemsize": _parts.itemsize,
    }
)


class Row:
    """One row, filled again and again.

    Attributes:
        record: ROW array (1,), for `moment.fill_row`.
        moment: its MOMENT, an array (1,).
        quick, full: the text that goes into the log, without and with the slow topics; the next filling changes it.
    """

    def __init__(self) -> None:
        self.record = np.zeros(1, ROW)
        self.moment = self.record["moment"][0]
        self.moment["motors"] = self.moment["servos"] = math.nan
        self.moment["esc_function"] = range(FIRST_MOTOR, FIRST_MOTOR + MOTORS)
        text = self.record["text"][0]
        text[:] = np.frombuffer(_text, np.uint8)
        begin = _inside["text"][1]
        # What never changes comes from itself.
        self.record["places"][0] = [own if place is None else place for own, place in enumerate(_places, begin)]
        self.full = memoryview(text)
        self.quick = self.full[: len(_quick)]
