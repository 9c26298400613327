"""HIL messages field by field, in their own units: the numbers an autopilot would fly by."""

import math
from typing import Any

import numpy as np
import pytest

from sitl.hil.magnetic_field import MagneticField, in_body_axes
from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.context import Context, context_for
from sitl.mavlink.telemetry.streams import BUILDERS
from sitl.simulation import Simulation
from sitl.snapshot import Snapshot
from vehicle_model.records import OUTPUTS
from vehicle_model.state import blank_controls, blank_state

EPOCH = 1_735_689_600.0  # 2025-01-01
G = 9.80665


@pytest.fixture(scope="module")
def context() -> Context:
    return context_for(Simulation(autopilot=False), EPOCH)


def moment(**changes: Any) -> Snapshot:
    outputs = np.zeros(1, OUTPUTS)
    outputs["velocity_air_body"] = (28.0, 1.5, -2.5)
    fields: dict[str, Any] = {
        "time": 3601.0025,
        "state": blank_state(),
        "controls": blank_controls(),
        "outputs": outputs[0],
        "latitude": math.radians(-33.5),
        "longitude": math.radians(151.25),
        "height_ellipsoid": 1020.0,
        "altitude_msl": 1000.125,
        "position_ned": (0.0, 0.0, 0.0),
        "velocity_ned": (-20.5, 18.25, 1.75),
        "quaternion": (0.5, 0.5, -0.5, 0.5),
        "roll": 0.3,
        "pitch": -0.4,
        "yaw": 2.5,
        "rates": (0.125, -0.25, 0.5),
        "specific_force": (G, -2.0 * G, -1.5 * G),
        "airspeed": 30.0,
        "pressure": 89874.6,
        "temperature": 281.65,
        "density": 1.1116,
        "wind_ned": (0.0, 0.0, 0.0),
        "tilt": 0.1,
        "on_ground": False,
    }
    return Snapshot(**{**fields, **changes})


def sent(name: str, snapshot: Snapshot, context: Context) -> Any:
    packer = codec(name)
    values = BUILDERS[name](snapshot, context)
    assert values is not None
    frame = packer.frame(packer.payload(values), 0, 1, 1)
    return mav.MAVLink(None).decode(bytearray(frame))


def test_hil_state_quaternion(context: Context) -> None:
    m = sent("HIL_STATE_QUATERNION", moment(), context)
    assert m.time_usec == 3601002500
    assert m.attitude_quaternion == [0.5, 0.5, -0.5, 0.5]
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == (0.125, -0.25, 0.5)
    assert (m.lat, m.lon, m.alt) == (-335000000, 1512500000, 1000125)
    assert (m.vx, m.vy, m.vz) == (-2050, 1825, 175)
    assert m.true_airspeed == 3000
    assert m.ind_airspeed == round(3000 * math.sqrt(1.1116 / 1.225))
    assert (m.xacc, m.yacc, m.zacc) == (1000, -2000, -1500)  # mG


def test_hil_state(context: Context) -> None:
    m = sent("HIL_STATE", moment(), context)
    assert m.time_usec == 3601002500
    assert (m.roll, m.pitch, m.yaw) == pytest.approx((0.3, -0.4, 2.5))
    assert (m.rollspeed, m.pitchspeed, m.yawspeed) == (0.125, -0.25, 0.5)
    assert (m.lat, m.lon, m.alt, m.vx, m.vy, m.vz) == (-335000000, 1512500000, 1000125, -2050, 1825, 175)
    assert (m.xacc, m.yacc, m.zacc) == (1000, -2000, -1500)


def test_hil_sensor(context: Context) -> None:
    m = sent("HIL_SENSOR", moment(), context)
    assert m.time_usec == 3601002500
    assert (m.xacc, m.yacc, m.zacc) == pytest.approx((G, -2.0 * G, -1.5 * G))
    assert (m.xgyro, m.ygyro, m.zgyro) == (0.125, -0.25, 0.5)
    assert m.abs_pressure == pytest.approx(898.746)  # hPa
    assert m.diff_pressure == pytest.approx(0.5 * 1.1116 * 28.0**2 / 100.0)
    assert m.pressure_alt == pytest.approx(1000.0, abs=0.5)  # standard atmosphere: 898.746 hPa at 1000 m
    assert m.temperature == pytest.approx(8.5)
    assert m.fields_updated == 0x1FFF
    assert m.id == 0
    # Sydney: 57 000 nT, pointing up and north (Geoscience Australia).
    assert math.hypot(m.xmag, m.ymag, m.zmag) == pytest.approx(0.57, abs=0.01)


def test_a_pitot_tube_in_reversed_flow_reads_negative(context: Context) -> None:
    outputs = np.zeros(1, OUTPUTS)
    outputs["velocity_air_body"] = (-3.0, 0.0, 0.0)
    assert sent("HIL_SENSOR", moment(outputs=outputs[0]), context).diff_pressure == pytest.approx(
        -0.5 * 1.1116 * 9.0 / 100.0
    )


def test_hil_gps(context: Context) -> None:
    m = sent("HIL_GPS", moment(), context)
    assert (m.time_usec, m.fix_type, m.id) == (3601002500, 3, 0)
    assert (m.lat, m.lon, m.alt) == (-335000000, 1512500000, 1000125)
    assert (m.vn, m.ve, m.vd) == (-2050, 1825, 175)
    assert m.vel == round(math.sqrt(20.5**2 + 18.25**2) * 100)
    assert m.cog == pytest.approx((180.0 - math.degrees(math.atan(18.25 / 20.5))) * 100, abs=1)
    assert m.yaw == round(math.degrees(2.5) * 100)
    assert 0 < m.eph < 65535
    assert 0 < m.epv < 65535
    assert 4 <= m.satellites_visible < 255


def test_hil_gps_has_no_course_below_a_tenth_of_a_metre_per_second(context: Context) -> None:
    creeping = sent("HIL_GPS", moment(velocity_ned=(-0.06, 0.07, -3.0)), context)
    assert (creeping.cog, creeping.vel, creeping.vn, creeping.ve, creeping.vd) == (65535, 9, -6, 7, -300)
    assert sent("HIL_GPS", moment(velocity_ned=(-0.08, 0.08, -3.0)), context).cog == 13500


def test_hil_gps_yaw_north_is_36000_because_0_means_unknown(context: Context) -> None:
    assert sent("HIL_GPS", moment(yaw=0.0), context).yaw == 36000
    assert sent("HIL_GPS", moment(yaw=-math.pi / 2), context).yaw == 27000


@pytest.mark.parametrize(
    ("latitude", "longitude", "north", "east", "down"),
    [  # World Magnetic Model 2025, published test values at 2025.0 and height 0 [nT]
        (80.0, 0.0, 6521.6, 145.9, 54791.5),
        (0.0, 120.0, 39677.8, -109.6, -10580.2),
        (-80.0, 240.0, 6117.5, 15751.9, -52022.5),
    ],
)
def test_magnetic_field_has_the_published_test_values(
    latitude: float, longitude: float, north: float, east: float, down: float
) -> None:
    field = MagneticField(EPOCH).ned(latitude, longitude, 0.0)
    assert [component * 1e5 for component in field] == pytest.approx([north, east, down], abs=0.06)


def test_days_outside_the_model_use_its_nearest() -> None:
    assert MagneticField(0.0).year == 2025.0
    assert MagneticField(2.0e9).year == 2030.0
    assert MagneticField(1_790_000_000.0).year == pytest.approx(2026.72, abs=0.01)


def test_a_vector_turns_into_body_axes_as_the_rotation_matrix_says() -> None:
    w, x, y, z = np.array([0.3, -0.5, 0.7, 0.2]) / math.sqrt(0.87)
    body_to_ned = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    vector = (0.21, -0.03, 0.43)
    assert in_body_axes(vector, (w, x, y, z)) == pytest.approx(tuple(body_to_ned.T @ vector))
