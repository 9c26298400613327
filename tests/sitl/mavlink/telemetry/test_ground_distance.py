"""How far the ground is, along the body and straight down."""

from collections.abc import Callable

import pytest
from scipy.spatial.transform import Rotation

from sitl.mavlink.dialect import tiltwing as mav
from sitl.snapshot import Snapshot
from tests.sitl.mavlink.telemetry.observed import Observed

Moment = Callable[..., Snapshot]


@pytest.fixture
def observed() -> Observed:
    return Observed()


def test_distance_sensor_looks_down_the_body(moment: Moment, observed: Observed) -> None:
    snapshot = moment()
    down = Rotation.from_quat(snapshot.quaternion, scalar_first=True).apply([0.0, 0.0, 1.0])[2]
    m = observed.sent("DISTANCE_SENSOR", snapshot)
    assert (m.time_boot_ms, m.min_distance, m.max_distance) == (12348, 10, 10000)
    assert m.current_distance == round(23.5 / down * 100.0)
    assert (m.type, m.id, m.orientation) == (mav.MAV_DISTANCE_SENSOR_LASER, 0, mav.MAV_SENSOR_ROTATION_PITCH_270)
    assert (m.covariance, m.signal_quality, m.quaternion) == (0, 100, [0.0] * 4)
    assert observed.sent("RANGEFINDER", snapshot).distance == pytest.approx(23.5 / down)
    assert observed.sent("RANGEFINDER", snapshot).voltage == 0.0


@pytest.mark.parametrize(
    ("height", "quaternion", "reading", "quality"),
    [
        (150.0, (1.0, 0.0, 0.0, 0.0), 10000, 1),  # too far
        (0.05, (1.0, 0.0, 0.0, 0.0), 5, 1),  # too near
        (-0.01, (1.0, 0.0, 0.0, 0.0), 0, 1),
        (5.0, (0.0, 1.0, 0.0, 0.0), 10000, 1),  # upside down
        (5.0, (1.0, 0.0, 0.0, 0.0), 500, 100),
    ],
)
def test_out_of_range_is_no_valid_signal(
    moment: Moment,
    observed: Observed,
    height: float,
    quaternion: tuple[float, float, float, float],
    reading: int,
    quality: int,
) -> None:
    snapshot = moment(quaternion=quaternion)
    snapshot.outputs["height_above_ground"] = height
    m = observed.sent("DISTANCE_SENSOR", snapshot)
    assert (m.current_distance, m.signal_quality) == (reading, quality)


def test_terrain_report(moment: Moment, observed: Observed) -> None:
    m = observed.sent("TERRAIN_REPORT", moment())
    assert (m.lat, m.lon) == (473977000, -85456000)
    assert (m.terrain_height, m.current_height) == (512.25 - 23.5, 23.5)
    assert (m.spacing, m.pending, m.loaded) == (100, 0, 0)  # known: a spacing of zero would deny it
