"""NASA's check-cases 1 to 7 flown by the aircraft's own equations, and what the case runner says of bad cases."""

import csv
from pathlib import Path

import numpy as np
import pytest

from vehicle_model.check_case import CaseFileError, CaseResult, bare_body, run_case
from vehicle_model.check_case_file import Body
from vehicle_model.earth import gravitation, make_environment

CASES = sorted((Path(__file__).parent / "check_cases").glob("*.toml"))
# The full trajectories are not part of the repository; where they lie beside it, every sample is compared.
TRAJECTORIES = Path(__file__).parents[3] / "shared" / "reference" / "nesc"

FOOT, SLUG = 0.3048, 0.45359237 * 9.80665 / 0.3048


def case_file(number: int) -> Path:
    (path,) = (path for path in CASES if path.name.startswith(f"nesc_{number:02d}_"))
    return path


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_case_ends_where_nasas_simulations_ended(path: Path) -> None:
    result = run_case(path)
    assert {"height_ellipsoid", "longitude", "velocity_ned", "euler", "density"} <= {c.quantity for c in result.checks}
    assert result.passed, str(result)


def trajectory(case: int, sim: int) -> dict[str, np.ndarray]:
    path = TRAJECTORIES / f"Atmos_{case:02d}_sim_{sim:02d}.csv"
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the repository")
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def columns(data: dict[str, np.ndarray], stem: str, *ends: str) -> np.ndarray:
    return np.stack([data[f"{stem}_{end}"] for end in ends], axis=1)


def turned(angle: np.ndarray, reference: np.ndarray) -> np.ndarray:
    return (angle - reference + 180.0) % 360.0 - 180.0


# Tolerances are a few times what double precision and 0.01 s steps leave, far below the spread of NASA's simulations.
# Only SIM 05 damps the rotation relative to the Earth and its air, so in case 3 the attitude is compared with that.
@pytest.mark.parametrize(
    ("case", "sim", "height_ft", "euler_deg", "rates_deg_s"),
    [
        (1, 4, 1e-4, 1e-6, 1e-9),
        (1, 5, 1e-4, 1e-6, 1e-9),
        (2, 4, 1e-4, 1e-6, 1e-6),
        (2, 5, 1e-4, 1e-3, 5e-4),
        (3, 5, 1e-4, 5e-3, 5e-4),
        (4, 4, 0.02, 1e-6, 1e-6),
        (4, 5, 0.02, 1e-6, 1e-6),
        (5, 4, 0.02, 1e-6, 1e-6),
        (5, 5, 0.02, 1e-6, 1e-6),
        (6, 4, 0.02, 1e-6, 1e-9),
        (6, 5, 0.02, 1e-6, 1e-9),
        (7, 4, 0.02, 1e-6, 1e-9),
        (7, 5, 0.02, 1e-6, 1e-9),
    ],
)
def test_every_sample_of_nasas_trajectory_is_met(
    case: int, sim: int, height_ft: float, euler_deg: float, rates_deg_s: float
) -> None:
    nasa = trajectory(case, sim)
    ours = run_case(case_file(case))
    np.testing.assert_allclose(ours.time, nasa["time"], atol=1e-6)
    np.testing.assert_allclose(ours.height_ellipsoid / FOOT, nasa["altitudeMsl_ft"], rtol=0.0, atol=height_ft)
    velocity = columns(nasa, "feVelocity_ft_s", "X", "Y", "Z")
    np.testing.assert_allclose(ours.velocity_ned / FOOT, velocity, rtol=0.0, atol=1e-3)
    euler = columns(nasa, "eulerAngle_deg", "Roll", "Pitch", "Yaw")
    np.testing.assert_allclose(turned(np.degrees(ours.euler), euler), 0.0, atol=euler_deg)
    rates = columns(nasa, "bodyAngularRateWrtEi_deg_s", "Roll", "Pitch", "Yaw")
    np.testing.assert_allclose(np.degrees(ours.rates), rates, rtol=0.0, atol=rates_deg_s)
    for angle, name in ((ours.latitude, "latitude_deg"), (ours.longitude, "longitude_deg")):
        np.testing.assert_allclose(np.degrees(angle), nasa[name], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(ours.density / (SLUG / FOOT**3), nasa["airDensity_slug_ft3"], rtol=5e-6)
    np.testing.assert_allclose(ours.speed_of_sound / FOOT, nasa["speedOfSound_ft_s"], rtol=5e-6)
    np.testing.assert_allclose(ours.temperature * 1.8, nasa["ambientTemperature_dgR"], rtol=5e-6)
    np.testing.assert_allclose(gravitation_along(ours, case) / FOOT, nasa["localGravity_ft_s2"], rtol=1e-9)


def gravitation_along(result: CaseResult, case: int) -> np.ndarray:
    """Strength of gravitation at each sample [m/s^2]."""
    earth = "round" if case in {4, 5} else "wgs84"
    env = make_environment(earth, latitude=0.0, longitude=0.0, height_ellipsoid=30000.0 * FOOT)
    return np.array([np.linalg.norm(gravitation(n, e, d, env[0])) for n, e, d in result.position_ned])


def test_inertia_of_point_masses_follows_from_moments_and_products() -> None:
    points, masses = np.array([[1.0, 2.0, 3.0], [-2.0, 0.5, 1.0], [0.3, -1.0, -2.0]]), np.array([1.0, 2.0, 0.5])
    x, y, z = points.T
    body = Body(
        mass=3.5,
        ixx=np.sum(masses * (y * y + z * z)),
        iyy=np.sum(masses * (x * x + z * z)),
        izz=np.sum(masses * (x * x + y * y)),
        ixy=np.sum(masses * x * y),
        ixz=np.sum(masses * x * z),
        iyz=np.sum(masses * y * z),
        reference_area=0.0,
        reference_span=0.0,
        reference_chord=0.0,
        drag_coefficient=0.0,
        roll_damping=0.0,
        pitch_damping=0.0,
        yaw_damping=0.0,
    )
    rates = np.array([0.3, -0.7, 1.1])
    momentum = sum(m * np.cross(r, np.cross(rates, r)) for m, r in zip(masses, points, strict=True))
    vehicle = bare_body(body)
    np.testing.assert_allclose(vehicle["inertia"][0] @ rates, momentum, rtol=1e-13)
    np.testing.assert_allclose(vehicle["inertia_inverse"][0] @ momentum, rates, rtol=1e-12)


def edited(tmp_path: Path, *changes: tuple[str, str], case: int = 7) -> Path:
    text = case_file(case).read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_flight_beyond_its_tolerance_fails_and_says_by_how_much(tmp_path: Path) -> None:
    result = run_case(edited(tmp_path, ("value = 16285.1612", "value = 16286.1612")))
    failed = [check for check in result.checks if not check.passed]
    assert not result.passed
    assert [check.quantity for check in failed] == ["height_ellipsoid"]
    assert failed[0].difference == pytest.approx(FOOT, rel=1e-3)
    assert "FAIL" in str(result)


def test_angles_are_compared_modulo_a_turn(tmp_path: Path) -> None:
    plus_a_turn = edited(tmp_path, ("-56.1513076", "303.8486924"), case=2)
    assert run_case(plus_a_turn).passed


def test_a_body_that_moves_with_the_wind_feels_only_the_air_it_falls_through(tmp_path: Path) -> None:
    path = edited(
        tmp_path,
        ('"wgs84"', '"flat"'),
        ("rotating        = true", "rotating        = false"),
        ("velocity_ned     = { value = [0.0, 0.0, 0.0]", "velocity_ned     = { value = [0.0, 20.0, 0.0]"),
    )
    result = run_case(path)
    np.testing.assert_allclose(result.velocity_ned[:, 1], 20.0 * FOOT, rtol=1e-12)
    np.testing.assert_allclose(result.velocity_ned[:, 0], 0.0, atol=1e-12)
    free_fall = 9.80665 * result.time
    assert np.all(result.velocity_ned[5:, 2] < free_fall[5:])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('unit = "slug" }', 'unit = "ft" }', r":14: body\.mass: expected a mass in kg .* got 1 ft"),
        ("drag_coefficient", "drag_coeficient", r"body\.drag_coeficient: no such key"),
        ("yaw_damping      = ", "# ", r"body\.yaw_damping: missing"),
        ('"wgs84"', '"disc"', r'earth: expected "flat" or "round" or "wgs84", got "disc"'),
        ('"wgs84"', '"flat"', r'rotating: expected false where earth = "flat"'),
        ("value = 0.01,", "value = 0.03,", r"sample_interval: expected a multiple of time_step, 0\.03 s"),
        ("value = 0.01,", "value = 0,", r"time_step: expected a time in s between"),
        ("value = 30.0, unit", "value = 30.5, unit", r"duration: expected a multiple of sample_interval, 1 s"),
        ("time      = { value = 30", "time      = { value = 31", r"expected\.0\.time: expected .* up to 30 s"),
        ('"latitude"', '"lattitude"', r"expected\.1\.quantity: expected one of .* got 'lattitude'"),
        ('quantity  = "latitude"', "", r"expected\.1\.quantity: expected one of .* got none"),
        ("ixx              = { value = 3", "ixx              = { value = 33", r"body: expected moments of inertia"),
        ("[body]", "[body", r"not valid TOML"),
    ],
)
def test_bad_case_gets_one_line_that_names_file_entry_and_what_was_expected(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = edited(tmp_path, (old, new))
    with pytest.raises(CaseFileError, match=message) as caught:
        run_case(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_missing_case_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(CaseFileError, match=r"nowhere\.toml: cannot be read: No such file"):
        run_case(tmp_path / "nowhere.toml")
