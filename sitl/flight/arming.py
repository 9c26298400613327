"""What speaks against arming, in a pilot's words: every reason there is, so that all can be mended at once."""

import math
from dataclasses import astuple

from sitl.flight.landed import LandedState
from sitl.flight.mode import Mode
from sitl.flight.parameters import Parameters
from sitl.flight.view import View

__all__ = ["ArmingChecks"]

RATE = math.radians(10.0)  # about any axis [rad/s]
SPEED = 0.5  # over the ground [m/s]
TILT_ERROR = math.radians(10.0)  # between the wing and where it is told to be
THROTTLE_LOW = 0.05  # of the stick's travel

# Modes that begin a flight; the others end one or need one under way.
ARMABLE = frozenset(
    {
        Mode.MANUAL, Mode.STABILIZED, Mode.ALTITUDE, Mode.POSITION,
        Mode.HOLD, Mode.TAKEOFF, Mode.MISSION, Mode.OFFBOARD,
    }
)  # fmt: skip

# Each must not be more than the next.
ORDERED = (
    ("FW_AIRSPD_MIN", "FW_AIRSPD_TRIM", "FW_AIRSPD_MAX"),
    ("BAT_EMERGEN_THR", "BAT_CRIT_THR", "BAT_LOW_THR"),
    ("MPC_XY_CRUISE", "MPC_XY_VEL_MAX"),
)


class ArmingChecks:
    """Compares the vehicle's state with what a flight may begin with."""

    def __init__(self, parameters: Parameters, empty_voltage: float) -> None:
        """`empty_voltage` is that of the discharged battery at rest [V]."""
        self._parameters = parameters
        self._empty_voltage = empty_voltage

    def problems(
        self,
        view: View,
        landed: LandedState,
        mode: Mode,
        *,
        inside_fence: bool = True,
        mission_feasible: bool | None = None,
        faults: tuple[str, ...] = (),
        throttle: float | None = None,
    ) -> list[str]:
        """Every reason not to arm, none if ready.

        Args:
            view: the present moment.
            landed: landed state.
            mode: in which the flight would begin.
            inside_fence: the vehicle is where the geofence allows it to be.
            mission_feasible: None if there is no mission.
            faults: actuators known to have failed, as `ActuatorWatch.faults`.
            throttle: where the throttle stick is, 0 lowest to 1; None without manual control.
        """
        if not _is_known(view):
            return ["position and attitude are not known"]
        found = self._vehicle_problems(view, faults) + self._ground_problems(view, landed)
        if not inside_fence:
            found.append("outside the geofence")
        return found + _mode_problems(mode, mission_feasible, throttle)

    def _ground_problems(self, view: View, landed: LandedState) -> list[str]:
        found: list[str] = []
        if landed != LandedState.ON_GROUND:
            found.append("not on the ground")
        limit = self._parameters["TW_ARM_LEVEL"]
        for name, angle in (("roll", view.roll), ("pitch", view.pitch)):
            if abs(angle) > math.radians(limit):
                found.append(f"not level: {name} {math.degrees(angle):.0f} deg, at most {limit:g} deg")
        rate = max(abs(view.p), abs(view.q), abs(view.r))
        if rate > RATE:
            found.append(f"turning at {math.degrees(rate):.0f} deg/s, at most {math.degrees(RATE):.0f} deg/s")
        speed = math.hypot(view.vn, view.ve, view.vd)
        if speed > SPEED:
            found.append(f"moving at {speed:.1f} m/s, at most {SPEED:g} m/s")
        return found

    def _vehicle_problems(self, view: View, faults: tuple[str, ...]) -> list[str]:
        parameters = self._parameters
        found = [f"{fault}: not repaired" for fault in faults]
        least = parameters["COM_ARM_BAT_MIN"]
        if view.battery_remaining < least:
            charge = math.floor(1000.0 * view.battery_remaining) / 10.0  # rounded up it might seem enough
            found.append(f"battery at {charge:g} %, at least {100.0 * least:g} %")
        if view.battery_voltage < self._empty_voltage:
            found.append(f"battery at {view.battery_voltage:.1f} V, empty at {self._empty_voltage:.1f} V")
        if abs(view.tilt - view.tilt_command) > TILT_ERROR:
            tilt, command = math.degrees(view.tilt), math.degrees(view.tilt_command)
            found.append(f"wing at {tilt:.0f} deg though told to be at {command:.0f} deg: tilt servo moving or stuck")
        for names in ORDERED:
            values = [parameters[name] for name in names]
            if values != sorted(values):
                found.append(f"parameters: expected {' <= '.join(names)}, got {', '.join(f'{v:g}' for v in values)}")
        return found


def _mode_problems(mode: Mode, mission_feasible: bool | None, throttle: float | None) -> list[str]:
    found: list[str] = []
    if mode not in ARMABLE:
        found.append(f"{mode.title} does not begin a flight")
    if mode == Mode.MISSION and not mission_feasible:
        found.append("no mission" if mission_feasible is None else "the mission cannot be flown")
    if not mode.by_sticks:
        return found
    if throttle is None:
        found.append(f"{mode.title} needs manual control")
    elif mode <= Mode.STABILIZED and throttle > THROTTLE_LOW:
        found.append("throttle stick is not at its lowest")
    elif throttle > 0.5 + THROTTLE_LOW:
        found.append("throttle stick asks to climb")
    return found


def _is_known(view: View) -> bool:
    """Whether all numbers of the view are finite."""
    return all(math.isfinite(v) for v in astuple(view) if isinstance(v, float))
