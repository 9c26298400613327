"""Which part of the vehicle makes its pitching moment: at fixed controls out of hover, and along the level trims."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vehicle_model.aircraft import Aircraft
from vehicle_model.integrate import observe
from vehicle_model.records import OUTPUTS
from vehicle_model.state import ELEVATOR, ROTOR_SPEED, STATE_COUNT, VELOCITY
from vehicle_model.trim import Trim, still_air

__all__ = [
    "PARTS",
    "PitchingMoments",
    "fixed_control_moments",
    "moments_by_part",
    "neutral_elevator_moments",
]

PARTS = ("propellers", "wing in the slipstream", "wing outside it", "tailplane", "tail propeller", "fuselage and fin")


@dataclass(frozen=True)
class PitchingMoments:
    """Pitching moment [N m], nose up positive, of each of PARTS (6, n) at airspeeds (n,) [m/s]."""

    airspeed: np.ndarray
    parts: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Of the whole vehicle (n,) [N m]."""
        return self.parts.sum(axis=0)


def moments_by_part(aircraft: Aircraft, outputs: np.void) -> np.ndarray:
    """Pitching moment about the centre of mass of each of PARTS (6,) [N m] in an OUTPUTS record of symmetric flight."""
    wetted, unwetted = aircraft.wing_strips
    names = aircraft.surface_names
    rotors = _pitching(outputs["rotor_point_body"], outputs["rotor_force_body"])
    surfaces = _pitching(outputs["surface_point_body"], outputs["surface_force_body"])
    hull = _pitching(aircraft.vehicle[0]["fuselage_position"], outputs["fuselage_force_body"])
    return np.array(
        [
            rotors[:2].sum(),
            surfaces[wetted].sum(),
            surfaces[unwetted].sum(),
            surfaces[names.index("horizontal tail")],
            rotors[2],
            hull + surfaces[names.index("vertical tail")],
        ]
    )


def _pitching(point: np.ndarray, force: np.ndarray) -> np.ndarray:
    """M = z X - x Z of forces (..., 3) acting at points (..., 3)."""
    return point[..., 2] * force[..., 0] - point[..., 0] * force[..., 2]


def fixed_control_moments(aircraft: Aircraft, hover: Trim, airspeeds: Sequence[float] | np.ndarray) -> PitchingMoments:
    """Moments in level forward flight at `airspeeds` [m/s] with rotor speeds, tilt and elevator left as in hover."""
    speeds = np.asarray(airspeeds, dtype=float)
    columns = [_moments(aircraft, hover, {VELOCITY: float(speed)}) for speed in speeds]
    return PitchingMoments(speeds, np.column_stack(columns))


def neutral_elevator_moments(aircraft: Aircraft, trims: Sequence[Trim]) -> PitchingMoments:
    """Moments that the equivalent elevator trims out: at level trims, with elevator and tail propeller at rest."""
    columns = [_moments(aircraft, trim, {ELEVATOR: 0.0, ROTOR_SPEED + 2: 0.0}) for trim in trims]
    return PitchingMoments(np.array([trim.airspeed for trim in trims]), np.column_stack(columns))


def _moments(aircraft: Aircraft, trim: Trim, changed: dict[int, float]) -> np.ndarray:
    """Moments of each part at a trim with some of its states changed."""
    state = trim.state.copy()
    state[list(changed)] = list(changed.values())
    outputs, rate = np.zeros(1, OUTPUTS), np.empty(STATE_COUNT)
    observe(state, trim.controls, aircraft.vehicle, still_air(), outputs, rate)
    return moments_by_part(aircraft, outputs[0])
