"""Metadata of motors and servos: which there are, where they sit, how they can be tested.

https://github.com/mavlink/mavlink/blob/master/component_metadata/actuators.schema.json. Which output drives what is a
matter of the aircraft's file, not of parameters, so nothing can be configured.
"""

from typing import Any, Final

from vehicle_model.aircraft import Aircraft, Channel

__all__ = ["FIRST_MOTOR", "FIRST_SERVO", "actuator_metadata"]

VERSION: Final = 2  # of the schema
# Output functions by PX4's numbers; ACTUATOR_TEST is sent 1000 more.
FIRST_MOTOR, FIRST_SERVO = 101, 201
AXES: Final = ("x", "y", "z")


def actuator_metadata(aircraft: Aircraft) -> dict[str, Any]:
    """What is known of an aircraft's actuators: actuators.json."""
    motors = [channel for channel in aircraft.channels if channel.is_motor]
    servos = [channel for channel in aircraft.channels if not channel.is_motor]
    types, groups = _motors(motors, aircraft)
    types["servo"] = {
        "function-min": FIRST_SERVO,
        "function-max": FIRST_SERVO + len(servos) - 1,
        "values": {"min": -1, "max": 1, "default": 0},
    }
    groups.append(
        {
            "group-label": "Servos",
            "actuator-type": "servo",
            "count": len(servos),
            "item-label-prefix": [_label(channel) for channel in servos],
            "per-item-parameters": [],
        }
    )
    functions = {0: "Disabled"}
    functions |= {FIRST_MOTOR + number: _label(channel) for number, channel in enumerate(motors)}
    functions |= {FIRST_SERVO + number: _label(channel) for number, channel in enumerate(servos)}
    return {
        "version": VERSION,
        "outputs_v1": [
            {
                "label": "Outputs",
                "subgroups": [
                    {
                        "per-channel-parameters": [],
                        "channels": [
                            {"label": f"{channel.number} {_label(channel)}", "param-index": channel.number}
                            for channel in sorted(aircraft.channels, key=lambda channel: channel.number)
                        ],
                    }
                ],
            }
        ],
        "functions_v1": {str(number): {"label": label} for number, label in functions.items()},
        "mixer_v1": {
            "actuator-types": types | {"DEFAULT": {"values": {"min": -1, "max": 1, "default": 0}}},
            "config": [{"title": "Tilt-wing", "actuators": groups}],
        },
    }


def _motors(motors: list[Channel], aircraft: Aircraft) -> tuple[dict[str, Any], list[Any]]:
    """Types and groups of motors: each run of neighbours that do or do not turn both ways is one."""
    positions = aircraft.vehicle[0]["rotors"]["position"]
    runs: list[list[int]] = []
    for number, channel in enumerate(motors):
        if runs and motors[runs[-1][0]].normalised_minimum == channel.normalised_minimum:
            runs[-1].append(number)
        else:
            runs.append([number])
    types: dict[str, Any] = {}
    groups: list[Any] = []
    for run in runs:
        lowest = motors[run[0]].normalised_minimum
        name = "motor" if lowest == 0.0 else "reversible-motor"
        name = name if name not in types else f"{name}-{run[0] + 1}"
        types[name] = {
            "function-min": FIRST_MOTOR + run[0],
            "function-max": FIRST_MOTOR + run[-1],
            "label-index-offset": 1,
            "values": {"min": lowest, "max": 1, "default-is-nan": True},
        }
        places = [positions[motors[number].index] for number in run]
        groups.append(
            {
                "group-label": "Motors" if lowest == 0.0 else "Reversible motors",
                "actuator-type": name,
                "required": True,
                "count": len(run),
                "item-label-prefix": [_label(motors[number]) for number in run],
                "per-item-parameters": [
                    {
                        "label": f"Position {axis.upper()}",
                        "function": f"pos{axis}",
                        "value": [round(float(place[number]), 3) for place in places],
                    }
                    for number, axis in enumerate(AXES)
                ],
            }
        )
    return types, groups


def _label(channel: Channel) -> str:
    """A channel's name for people: "throttle_left" is the left motor."""
    words = channel.control.split("_")
    if channel.is_motor:
        words = [*words[1:], "motor"]
    elif len(words) > 1:
        words = [*words[1:], words[0]]
    return " ".join(words).capitalize()
