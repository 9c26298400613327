"""Everything the figures and the page show, computed once from the aircraft."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares

from vehicle_model.aircraft import Aircraft
from vehicle_model.authority import Margins, hover_margins, thrust_to_weight
from vehicle_model.earth import STANDARD_GRAVITY
from vehicle_model.elevator_step import ElevatorStep, elevator_step
from vehicle_model.linearise import HOLDS, Hold, LinearModel, Mode, linearise, modes
from vehicle_model.paper.loads_by_part import (
    PitchingMoments,
    fixed_control_moments,
    neutral_elevator_moments,
)
from vehicle_model.paper.printed import CALIBRATED_HOLD, CRUISE_AIRSPEED
from vehicle_model.steady_flight import trim_steady
from vehicle_model.trim import Trim, TrimError, trim_each, trim_sweep

__all__ = ["STEP", "WIND", "Descent", "HoverBalance", "Results", "StepSummary", "compute", "fit_oscillation"]


AIRSPEEDS = np.arange(31.0)
STEP = math.radians(1.0)  # of the elevator in Fig. 11
WIND = 8.0  # in which control in hover is asked for [m/s]
DESCENT_TILTS = (60.0, 45.0, 30.0)  # [deg]
DESCENT_ANGLES = np.radians(np.arange(0.0, 20.1, 1.0))


@dataclass(frozen=True)
class StepSummary:
    """The elevator step in numbers; u and w are changes from trim. SI and radians."""

    u: tuple[float, float]  # lowest and highest
    w: tuple[float, float]
    q: tuple[float, float]
    theta: tuple[float, float]
    phugoid: Mode  # fitted to u and theta of the flight
    u_per_theta: float  # ratio of their amplitudes [m/s per rad]
    linear_u_per_theta: float  # and that of the eigenvector
    final_u: float  # where the linear model comes to rest
    final_w: float
    linear_error: float  # largest distance from the linear response, over its peak, worst of the four


@dataclass(frozen=True)
class HoverBalance:
    """What sets the tilt in hover: thrust of the wing rotors, lift and drag of the wing in their slipstream [N]."""

    thrust: float
    lift: float
    drag: float

    @property
    def tilt_without_drag(self) -> float:
        """arctan(T/L) [rad]: eq. (13) with FX = 0 and no drag."""
        return math.atan2(self.thrust, self.lift)

    @property
    def tilt_with_drag(self) -> float:
        """arctan((T - D)/L) [rad]."""
        return math.atan2(self.thrust - self.drag, self.lift)


@dataclass(frozen=True)
class Descent:
    """Steady descents with the fuselage level at one airspeed; arrays (n,), shorter where no further trim exists."""

    airspeed: float
    angle: np.ndarray  # of the flight path, down positive [rad]
    power: np.ndarray  # shaft power over that of level flight
    tilt: np.ndarray  # [rad]
    wetted_margin: np.ndarray  # angle to maximum lift of the wing in the slipstream [rad]


@dataclass(frozen=True)
class Results:
    """What was computed of one aircraft. SI and radians."""

    aircraft: Aircraft
    trims: list[Trim]  # 0..30 m/s
    wetted_margin: np.ndarray  # (31,) angle to maximum lift, wing in the slipstream
    unwetted_margin: np.ndarray  # (31,) and outside it; nan in hover, where no air meets it
    jump_ratios: np.ndarray  # (3,) largest second difference at half the airspeed step, over that at the whole
    linear: dict[Hold, LinearModel]
    modes: dict[Hold, list[Mode]]
    step: ElevatorStep
    linear_step: np.ndarray  # (n, 4) u, w, q, theta: the linear model's answer, changes from trim
    step_summary: StepSummary
    hover: HoverBalance
    hover_moments: PitchingMoments
    hover_slopes: np.ndarray  # (6,) dM/dV of each part at V = 0 [N m per m/s]
    trim_moments: PitchingMoments
    descents: list[Descent]
    literal: list[Trim | None]  # trims with eqs (9)-(11) to the letter; None where there is none
    literal_modes: list[Mode]  # at 30 m/s; empty without a trim
    thrust_to_weight: float
    margins: list[tuple[float, Margins]]  # bearing of the wind and control left, hovering

    @property
    def weight(self) -> float:
        """[N]."""
        return float(self.aircraft.vehicle["mass"][0]) * STANDARD_GRAVITY

    @property
    def cruise(self) -> Trim:
        """The trim of Table 1 and Figs 11-13."""
        return self.trims[-1]

    @property
    def lift_to_drag(self) -> float:
        """Of level flight at 30 m/s: weight over what the wing propellers pull forward."""
        return self.weight / float(self.cruise.outputs["rotor_force_body"][:, 0].sum())

    @property
    def curves(self) -> np.ndarray:
        """The three curves of Fig. 10 (3, 31): RPM, tilt [deg], elevator [deg]."""
        return _curves(self.trims)

    def mode(self, name: str, hold: Hold = CALIBRATED_HOLD) -> Mode | None:
        """A mode at 30 m/s by name, or None if the aircraft has none of this name."""
        return next((mode for mode in self.modes[hold] if mode.name == name), None)


def compute(aircraft: Aircraft) -> Results:
    """Trim, linearise, fly and load the aircraft. Raises TrimError where the level trims or the hover do not exist."""
    trims = trim_sweep(aircraft, AIRSPEEDS)
    cruise = trims[-1]
    linear: dict[Hold, LinearModel] = {hold: linearise(aircraft, cruise, hold) for hold in HOLDS}
    wetted, unwetted = aircraft.wing_strips
    step = elevator_step(aircraft, CRUISE_AIRSPEED, STEP, every=4)
    longitudinal = linear[CALIBRATED_HOLD].longitudinal()
    driven = _driven(aircraft, longitudinal, step)
    linear_step = _linear_response(driven, step)
    literal_aircraft = aircraft.with_values({"wing.slipstream": "paper"})
    literal = _trims_where_possible(literal_aircraft)
    slowest = fixed_control_moments(aircraft, trims[0], (-0.1, 0.1))
    return Results(
        aircraft=aircraft,
        trims=trims,
        wetted_margin=np.array([trim.outputs["stall_margin"][wetted].min() for trim in trims]),
        unwetted_margin=np.array(
            [trim.outputs["stall_margin"][unwetted].min() if trim.airspeed else math.nan for trim in trims]
        ),
        jump_ratios=_jump_ratios(aircraft, trims),
        linear=linear,
        modes={hold: modes(model) for hold, model in linear.items()},
        step=step,
        linear_step=linear_step,
        step_summary=_summary(step, longitudinal, driven, linear_step),
        hover=_hover_balance(trims[0], wetted),
        hover_moments=fixed_control_moments(aircraft, trims[0], np.linspace(0.0, 10.0, 41)),
        hover_slopes=(slowest.parts[:, 1] - slowest.parts[:, 0]) / 0.2,
        trim_moments=neutral_elevator_moments(aircraft, trims),
        descents=[_descent(aircraft, trims, wetted, math.radians(tilt)) for tilt in DESCENT_TILTS],
        literal=literal,
        literal_modes=[] if literal[-1] is None else modes(linearise(literal_aircraft, literal[-1], CALIBRATED_HOLD)),
        thrust_to_weight=thrust_to_weight(aircraft),
        margins=[(bearing, left_over) for bearing, _, left_over in hover_margins(aircraft, WIND)],
    )


def _curves(trims: list[Trim]) -> np.ndarray:
    return np.array([[trim.rpm, math.degrees(trim.tilt), math.degrees(trim.elevator)] for trim in trims]).T


def _jump_ratios(aircraft: Aircraft, trims: list[Trim]) -> np.ndarray:
    """How second differences shrink as the airspeed step is halved: to 1/4 if smooth, 1/2 at a kink, 1 at a jump."""
    half = trim_sweep(aircraft, np.arange(0.0, 30.1, 0.5))
    whole, fine = (np.abs(np.diff(_curves(each), 2)).max(axis=1) for each in (trims, half))
    return fine / whole


def _trims_where_possible(aircraft: Aircraft) -> list[Trim | None]:
    """Level trims at 0..30 m/s, None at airspeeds without one."""
    return [each if isinstance(each, Trim) else None for each in trim_each(aircraft, AIRSPEEDS.tolist())]


def _driven(aircraft: Aircraft, model: LinearModel, step: ElevatorStep) -> np.ndarray:
    """M of x' = M x, x = [the longitudinal model's, elevator, 1]: the model behind its servo, driven by the step."""
    n = model.a.shape[0]
    matrix = np.zeros((n + 2, n + 2))
    matrix[:n, :n], matrix[:n, n] = model.a, model.b
    lag = 1.0 / float(aircraft.vehicle["servos"]["time_constant"][0, 3])
    matrix[n, n], matrix[n, n + 1] = -lag, lag * (step.controls_after[6] - step.controls_before[6])
    return matrix


def _linear_response(driven: np.ndarray, step: ElevatorStep) -> np.ndarray:
    """Response (n, 4) of u, w, q, theta of the driven model to the step, at the step's times."""
    turn = expm(driven * (step.time[1] - step.time[0]))
    x = np.zeros(len(driven))
    x[-1] = 1.0
    rows = np.zeros((len(step.time), 4))
    for i in np.flatnonzero(step.time > step.step_time + 1e-9):
        x = turn @ x
        rows[i] = x[:4]
    return rows


def fit_oscillation(time: np.ndarray, signals: np.ndarray, guess: Mode) -> tuple[complex, np.ndarray]:
    """Eigenvalue [1/s] and amplitudes (m,) of the damped oscillation that signals (n, m) have in common.

    Least squares of c + exp(sigma t) (a cos omega t + b sin omega t) for each signal.
    """
    scale = np.ptp(signals, axis=0)

    def fit(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        wave = np.exp((x[0] + 1j * x[1]) * (time - time[0]))
        basis = np.column_stack([np.ones_like(time), wave.real, wave.imag])
        weights = np.linalg.lstsq(basis, signals / scale)[0]
        return basis @ weights - signals / scale, weights

    best = least_squares(lambda x: fit(x)[0].ravel(), [guess.real, guess.imag], x_scale=[0.1, 0.1])
    _, weights = fit(best.x)
    return complex(*best.x), np.hypot(weights[1], weights[2]) * scale


def _summary(step: ElevatorStep, model: LinearModel, driven: np.ndarray, linear: np.ndarray) -> StepSummary:
    flown = np.column_stack([step.u - step.u[0], step.w - step.w[0], step.q, step.theta])
    values, vectors = np.linalg.eig(model.a)
    oscillations = np.flatnonzero(np.imag(values) > 1e-6)
    slowest = oscillations[np.argmin(np.abs(values[oscillations]))]
    late = step.time > step.step_time + 4.0  # the short period is over
    eigenvalue = complex(values[slowest])
    guess = Mode("phugoid", eigenvalue.real, eigenvalue.imag)
    found, (u_amplitude, theta_amplitude) = fit_oscillation(step.time[late], flown[late][:, [0, 3]], guess)
    final = np.linalg.solve(driven[:-1, :-1], -driven[:-1, -1])
    low, high = flown.min(axis=0), flown.max(axis=0)
    return StepSummary(
        *((float(a), float(b)) for a, b in zip(low, high, strict=True)),
        phugoid=Mode("phugoid", found.real, found.imag),
        u_per_theta=float(u_amplitude / theta_amplitude),
        linear_u_per_theta=float(abs(vectors[0, slowest] / vectors[3, slowest])),
        final_u=float(final[0]),
        final_w=float(final[1]),
        linear_error=float((np.abs(flown - linear).max(axis=0) / np.abs(linear).max(axis=0)).max()),
    )


def _hover_balance(hover: Trim, wetted: np.ndarray) -> HoverBalance:
    force = hover.outputs["surface_force_body"][wetted].sum(axis=0)
    cosine, sine = math.cos(hover.tilt), math.sin(hover.tilt)
    return HoverBalance(
        thrust=float(hover.outputs["thrust"][:2].sum()),
        lift=float(-force[0] * sine - force[2] * cosine),
        drag=float(-force[0] * cosine + force[2] * sine),
    )


def _descent(aircraft: Aircraft, trims: list[Trim], wetted: np.ndarray, tilt: float) -> Descent:
    """Descents at the airspeed at which level flight has this tilt."""
    tilts = np.array([trim.tilt for trim in trims])
    airspeed = float(np.interp(-tilt, -tilts, [trim.airspeed for trim in trims]))
    rows: list[tuple[float, float, float, float]] = []
    for angle in DESCENT_ANGLES:
        try:
            flight = trim_steady(aircraft, airspeed, climb_angle=-float(angle))
        except TrimError:
            break
        out = flight.outputs
        rows.append((angle, out["shaft_power"].sum(), flight.tilt, out["stall_margin"][wetted].min()))
    angles, power, found, margin = np.array(rows).reshape(-1, 4).T
    return Descent(airspeed, angles, power / power[:1], found, margin)
