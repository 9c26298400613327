"""The flight's parameters: name, range, default, unit and meaning of each, as a ground station lists them.

Where the meaning is PX4's the name, the unit and the numbers of the choices are PX4's too
(https://docs.px4.io/main/en/advanced_config/parameter_reference.html), degrees included; ranges and defaults are
those of this aircraft.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

__all__ = ["DEFINITIONS", "Definition"]


@dataclass(frozen=True)
class Definition:
    """What can be known of a parameter without flying.

    `values` tells the meaning of each number that an "int" may take, `bits` that of each bit, counted from 0; both are
    None if any number in the range will do. `group` is the heading under which ground stations list it. A fact
    (`read_only`) never has another value than its default; a setting with `reboot_required` takes effect when the
    vehicle begins anew.
    """

    name: str
    kind: Literal["int", "float"]
    default: float
    minimum: float
    maximum: float
    unit: str
    description: str
    values: dict[int, str] | None = None
    bits: dict[int, str] | None = None
    group: str = ""
    read_only: bool = False
    reboot_required: bool = False


def _number(name: str, default: float, minimum: float, maximum: float, unit: str, description: str) -> Definition:
    return Definition(name, "float", default, minimum, maximum, unit, description)


def _integer(name: str, default: int, minimum: int, maximum: int, description: str) -> Definition:
    return Definition(name, "int", default, minimum, maximum, "", description)


def _bits(name: str, default: int, bits: dict[int, str], description: str) -> Definition:
    return Definition(name, "int", default, 0, sum(1 << bit for bit in bits), "", description, bits=bits)


def _fact(name: str, kind: Literal["int", "float"], value: float, unit: str, description: str) -> Definition:
    return Definition(name, kind, value, value, value, unit, description, read_only=True)


def _choice(name: str, default: int, values: dict[int, str], description: str) -> Definition:
    return Definition(name, "int", default, min(values), max(values), "", description, values)


_LINK_LOSS = {1: "Hold", 2: "Return", 3: "Land", 5: "Terminate", 6: "Disarm"}

_TAKEOFF_AND_LANDING = (
    _number("MIS_TAKEOFF_ALT", 15.0, 1.0, 120.0, "m", "Height above the take-off point to climb to"),
    _number("MPC_TKO_SPEED", 1.5, 0.5, 5.0, "m/s", "Climb rate at take-off"),
    _number("MPC_LAND_SPEED", 0.4, 0.3, 0.55, "m/s", "Sink rate at touch-down"),
    _number("MPC_LAND_ALT2", 3.0, 1.0, 20.0, "m", "Height above ground below which a landing sinks at MPC_LAND_SPEED"),
)

_RETURN = (
    _number("RTL_RETURN_ALT", 40.0, 5.0, 150.0, "m", "Height above home to return at, or higher if already there"),
    _number("RTL_DESCEND_ALT", 20.0, 3.0, 100.0, "m", "Height above home to descend to before waiting RTL_LAND_DELAY"),
    _number("RTL_LAND_DELAY", 0.0, -1.0, 300.0, "s", "Wait above home before landing; negative: wait for a command"),
    _choice(
        "RTL_TYPE",
        0,
        {0: "Home or nearest rally point", 2: "Landing of the mission, if it has one"},
        "Where Return goes to",
    ),
)

_NAVIGATION = (
    _number("NAV_ACC_RAD", 10.0, 0.5, 200.0, "m", "Distance within which a waypoint is reached"),
    _number("NAV_LOITER_RAD", 80.0, 50.0, 1000.0, "m", "Radius of loiter circles, wing-borne"),
    _number("NAV_MC_ALT_RAD", 0.8, 0.1, 20.0, "m", "Height error within which a waypoint is reached in hover"),
    _number("NAV_FW_ALT_RAD", 5.0, 0.5, 50.0, "m", "Height error within which a waypoint is reached wing-borne"),
    _number("MIS_DIST_1WP", 2000.0, -1.0, 100000.0, "m", "Farthest first waypoint from home; 0 or less: any"),
    _choice(
        "MIS_TKO_LAND_REQ",
        0,
        {0: "None", 1: "Take-off", 2: "Landing", 3: "Take-off and landing", 4: "Both or neither"},
        "What a mission must have to be accepted",
    ),
)

_HOVER = (
    _number("MPC_XY_CRUISE", 5.0, 0.5, 10.0, "m/s", "Ground speed of missions and returns in hover"),
    _number(
        "MPC_XY_VEL_MAX", 8.0, 0.5, 12.0, "m/s", "Largest ground speed in hover; airspeed at full stick in Altitude"
    ),
    _number("MPC_Z_VEL_MAX_UP", 3.0, 0.5, 5.0, "m/s", "Largest climb rate in hover"),
    _number("MPC_Z_VEL_MAX_DN", 2.0, 0.5, 3.0, "m/s", "Largest sink rate in hover"),
    _number("MPC_Z_V_AUTO_UP", 2.5, 0.5, 5.0, "m/s", "Climb rate in hover when no pilot's stick sets it"),
    _number("MPC_Z_V_AUTO_DN", 1.5, 0.5, 3.0, "m/s", "Sink rate in hover when no pilot's stick sets it"),
    _number("MPC_MAN_TILT_MAX", 20.0, 1.0, 35.0, "deg", "Lean that a full stick asks for in hover"),
    _number("MPC_MAN_Y_MAX", 45.0, 5.0, 90.0, "deg/s", "Turn rate that a full stick asks for in hover"),
    _choice("WV_EN", 0, {0: "Keep heading", 1: "Turn into the wind"}, "What the nose does while hovering at a point"),
)

_CRUISE = (
    _number("FW_AIRSPD_MIN", 15.0, 12.0, 25.0, "m/s", "Lowest airspeed wing-borne"),
    _number("FW_AIRSPD_TRIM", 20.0, 12.0, 30.0, "m/s", "Airspeed when nothing else is asked for"),
    _number("FW_AIRSPD_MAX", 30.0, 15.0, 30.0, "m/s", "Highest airspeed"),
    _number("FW_R_LIM", 35.0, 10.0, 45.0, "deg", "Largest bank angle"),
    _number("FW_T_CLMB_MAX", 3.0, 0.5, 6.0, "m/s", "Largest climb rate wing-borne"),
    _number("FW_T_SINK_MAX", 2.5, 0.5, 5.0, "m/s", "Largest sink rate wing-borne"),
)

_ARMING = (
    _number("COM_DISARM_LAND", 1.5, -1.0, 60.0, "s", "Disarm this long after landing; 0 or less: never"),
    _number(
        "COM_DISARM_PRFLT", 10.0, -1.0, 600.0, "s", "Disarm if not taken off this long after arming; 0 or less: no"
    ),
    _number("COM_ARM_BAT_MIN", 0.2, 0.0, 1.0, "1", "Least share of the battery's charge to arm with"),
    _number("TW_ARM_LEVEL", 15.0, 1.0, 45.0, "deg", "Largest roll and pitch on the ground to arm with"),
)

_LOSSES = (
    _choice(
        "COM_RC_IN_MODE", 1, {1: "MAVLink", 4: "None: sticks are not listened to"}, "Where manual control comes from"
    ),
    _number("COM_RC_LOSS_T", 0.5, 0.0, 35.0, "s", "Manual control is lost after this long without its messages"),
    _choice("NAV_RCL_ACT", 2, _LINK_LOSS, "What loss of manual control does"),
    _bits(
        "COM_RCL_EXCEPT",
        0,
        {0: "Mission", 1: "Other automatic modes", 2: "Offboard"},
        "Modes that need no manual control, the sum of",
    ),
    _number("COM_DL_LOSS_T", 10.0, 1.0, 300.0, "s", "The ground station is lost after this long without heartbeat"),
    _choice("NAV_DLL_ACT", 0, {0: "Disabled"} | _LINK_LOSS, "What loss of the ground station does"),
    _number("COM_OF_LOSS_T", 1.0, 0.05, 60.0, "s", "Offboard control is lost after this long without a setpoint"),
    _choice(
        "COM_OBL_RC_ACT",
        0,
        {
            0: "Position",
            1: "Altitude",
            2: "Stabilized",
            3: "Return",
            4: "Land",
            5: "Hold",
            6: "Terminate",
            7: "Disarm",
        },
        "What loss of offboard control does; the modes flown by sticks become Hold where there is no manual control",
    ),
    _number("COM_FAIL_ACT_T", 5.0, 0.0, 25.0, "s", "Hold this long, for the pilot to step in, before Return or Land"),
)

_SAFETY = (
    _number("BAT_LOW_THR", 0.2, 0.0, 0.9, "1", "Share of charge below which the battery is low"),
    _number("BAT_CRIT_THR", 0.12, 0.0, 0.5, "1", "Share of charge below which COM_LOW_BAT_ACT acts"),
    _number("BAT_EMERGEN_THR", 0.07, 0.0, 0.3, "1", "Share of charge below which the vehicle lands at once"),
    _choice(
        "COM_LOW_BAT_ACT",
        3,
        {0: "Warning", 2: "Land when critical", 3: "Return when critical, land in an emergency"},
        "What a low battery does",
    ),
    _choice(
        "GF_ACTION",
        3,
        {0: "None", 1: "Warning", 2: "Hold", 3: "Return", 4: "Terminate", 5: "Land"},
        "What leaving the geofence does",
    ),
    _number("GF_MAX_HOR_DIST", 0.0, 0.0, 100000.0, "m", "Largest distance from home; 0: any"),
    _number("GF_MAX_VER_DIST", 0.0, 0.0, 10000.0, "m", "Largest height above home; 0: any"),
    _number("FD_FAIL_R", 75.0, 0.0, 180.0, "deg", "Roll beyond which the attitude is lost; 0: never"),
    _number("FD_FAIL_P", 60.0, 0.0, 90.0, "deg", "Pitch beyond which the attitude is lost; 0: never"),
    _number("FD_FAIL_R_TTRI", 0.3, 0.02, 5.0, "s", "The attitude is lost after so long beyond FD_FAIL_R"),
    _number("FD_FAIL_P_TTRI", 0.3, 0.02, 5.0, "s", "The attitude is lost after so long beyond FD_FAIL_P"),
    _choice(
        "CBRK_FLIGHTTERM",
        121212,
        {0: "Terminate", 121212: "Land instead"},
        "Circuit breaker of flight termination: whether a lost attitude may stop the motors",
    ),
    _choice(
        "COM_ACT_FAIL_ACT",
        2,
        {0: "Warning", 1: "Hold", 2: "Land", 3: "Return", 4: "Terminate"},
        "What the failure of a motor or of the tilt servo does",
    ),
)

_SYSTEM = (
    replace(_integer("MAV_SYS_ID", 1, 1, 255, "MAVLink system id of the vehicle"), reboot_required=True),
    _choice("SYS_FAILURE_EN", 0, {0: "Refused", 1: "Accepted"}, "What becomes of commands that inject failures"),
)

# Ground stations that know PX4 look these up before they call a vehicle ready.
_FACTS = (
    _fact("SYS_AUTOSTART", "int", 22000, "", "Airframe number: the first of those that PX4 leaves to its users"),
    _fact("SYS_HAS_NUM_ASPD", "int", 1, "", "How many airspeed sensors there are"),
    _fact("CAL_ACC0_ID", "int", 1, "", "Id of the accelerometer; 0 would ask for its calibration"),
    _fact("CAL_GYRO0_ID", "int", 1, "", "Id of the gyroscope; 0 would ask for its calibration"),
    _fact("CAL_MAG0_ID", "int", 1, "", "Id of the magnetometer; 0 would ask for its calibration"),
    _fact(
        "SENS_DPRES_OFF",
        "float",
        0.001,
        "Pa",
        "Offset of the airspeed sensor's pressure, too small to be seen; 0 would ask for its calibration",
    ),
)

_GROUPS = {
    "Take-off and landing": _TAKEOFF_AND_LANDING,
    "Return": _RETURN,
    "Navigation": _NAVIGATION,
    "Hover": _HOVER,
    "Cruise": _CRUISE,
    "Arming": _ARMING,
    "Lost links": _LOSSES,
    "Safety": _SAFETY,
    "System": _SYSTEM + _FACTS,
}


def _grouped() -> Iterator[Definition]:
    for group, definitions in _GROUPS.items():
        for definition in definitions:
            yield replace(definition, group=group)


DEFINITIONS: tuple[Definition, ...] = tuple(sorted(_grouped(), key=lambda definition: definition.name))
