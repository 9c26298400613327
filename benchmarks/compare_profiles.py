"""Writes docs/mavlink-compared.md: what PX4 and ArduPilot were measured to stream, send and obey, and what ours does.

`python benchmarks/compare_profiles.py --reference DIR`, where DIR has the notes on both (see profile_reference.py).
Ours is measured now, in real time, over UDP; that takes some minutes.
"""

import argparse
import math
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from profile_probe import Probe, Reply
from profile_reference import ANSWERED, ArdupilotProfile, NotesError, Px4Profile, read_ardupilot, read_px4
from profile_services import Row, services
from station import free_port

from sitl.mavlink.dialect import tiltwing as mav

__all__ = ["main"]

OUT = Path(__file__).parents[1] / "docs" / "mavlink-compared.md"
SECONDS = 20.0  # for which rates are counted
FASTEST_SECONDS = 6.0
FLYING = "--at=trim:20"
QUIET = "highlatency"  # what comes on such a link was asked for
NAN = math.nan
ENOUGH = 0.9  # of the other's rate
OCCASIONAL = frozenset({"EVENT", "PARAM_VALUE", "STATUSTEXT"})  # sent when there is something to tell
TAKEN = ("ACCEPTED", "IN_PROGRESS")
INTRODUCTION = """# MAVLink beside PX4 and ArduPilot

Theirs were measured on running builds: PX4 main of March 2026 (SIH standard VTOL), ArduPilot master of July 2025
(ArduPlane quadplane-tilt). Ours is measured over UDP, in real time, by `python benchmarks/compare_profiles.py`, which
writes this page."""
ON_REQUEST = "every station would have to answer; comes where SET_MESSAGE_INTERVAL asks for it"
NOT_FLYING = "refused with a text that says why: on the ground there is nothing to fly"
# What begins like this is missing on purpose.
ON_PURPOSE: Mapping[str, str] = {
    "stream PING": ON_REQUEST,
    "stream TIMESYNC": ON_REQUEST,
    "stream HIL_ACTUATOR_CONTROLS": "other simulated vehicles would take it for a claim to their servos; on request",
    "stream CURRENT_EVENT_SEQUENCE, disarmed viewer": "viewers show a motion; on request",
    "stream MISSION_CURRENT, disarmed viewer": "viewers show a motion; on request",
    "stream TERRAIN_REQUEST": "the ground is known everywhere, there is nothing to ask for",
    "command DO_VTOL_TRANSITION": NOT_FLYING,
    "command NAV_LAND": NOT_FLYING,
    "command RTL": NOT_FLYING,
    "command DO_REPOSITION": NOT_FLYING,
    "command DO_ORBIT": NOT_FLYING,
    "command DO_GRIPPER": "there is no gripper",
}
REQUESTS_NOTE = """Asked for in level flight; theirs on the ground. `sent`: acknowledged, and the message came."""
# The commands of PX4's notes by their names there.
COMMANDS: Mapping[str, tuple[int, tuple[float, ...]]] = {
    "REQUEST_AUTOPILOT_CAPABILITIES": (mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, (1,)),
    "DO_SET_MODE(auto loiter)": (mav.MAV_CMD_DO_SET_MODE, (1, 4, 3)),
    "DO_SET_HOME(current)": (mav.MAV_CMD_DO_SET_HOME, (1,)),
    "DO_CHANGE_SPEED": (mav.MAV_CMD_DO_CHANGE_SPEED, (0, 18, -1)),
    "RUN_PREARM_CHECKS": (mav.MAV_CMD_RUN_PREARM_CHECKS, ()),
    "DO_VTOL_TRANSITION(disarmed)": (mav.MAV_CMD_DO_VTOL_TRANSITION, (4,)),
    "NAV_TAKEOFF(disarmed)": (mav.MAV_CMD_NAV_TAKEOFF, ()),
    "NAV_VTOL_TAKEOFF(disarmed)": (mav.MAV_CMD_NAV_VTOL_TAKEOFF, ()),
    "NAV_LAND": (mav.MAV_CMD_NAV_LAND, ()),
    "RTL": (mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, ()),
    "MISSION_START": (mav.MAV_CMD_MISSION_START, ()),
    "DO_REPOSITION": (mav.MAV_CMD_DO_REPOSITION, (-1, 1, 0, NAN, 47.398, 8.546, 530)),
    "DO_ORBIT": (mav.MAV_CMD_DO_ORBIT, (80, 15, 0, 0, NAN, NAN, NAN)),
    "CONTROL_HIGH_LATENCY": (mav.MAV_CMD_CONTROL_HIGH_LATENCY, (0,)),
    "SET_MESSAGE_INTERVAL bad id": (mav.MAV_CMD_SET_MESSAGE_INTERVAL, (65_000, 1e5)),
    "DO_MOTOR_TEST": (mav.MAV_CMD_DO_MOTOR_TEST, (1, 0, 5, 0.2, 1, 0)),
    "ACTUATOR_TEST": (mav.MAV_CMD_ACTUATOR_TEST, (0.1, 0.2, 0, 0, 1)),
    "CONFIGURE_ACTUATOR": (mav.MAV_CMD_CONFIGURE_ACTUATOR, (1, 0, 0, 0, 1)),
    "DO_SET_SERVO": (mav.MAV_CMD_DO_SET_SERVO, (10, 1500)),
    "DO_SET_ACTUATOR": (mav.MAV_CMD_DO_SET_ACTUATOR, (0.5, NAN, NAN, NAN, NAN, NAN, 0)),
    "PREFLIGHT_CALIBRATION gyro": (mav.MAV_CMD_PREFLIGHT_CALIBRATION, (1, 0, 0, 0, 0, 0, 0)),
    "DO_GRIPPER": (mav.MAV_CMD_DO_GRIPPER, (1, 0)),
    "DO_FENCE_ENABLE": (mav.MAV_CMD_DO_FENCE_ENABLE, (1,)),
    "INJECT_FAILURE gps ok": (mav.MAV_CMD_INJECT_FAILURE, (4, 0, 0)),
    "GET_HOME_POSITION": (mav.MAV_CMD_GET_HOME_POSITION, ()),
    "DO_SET_STANDARD_MODE": (mav.MAV_CMD_DO_SET_STANDARD_MODE, (4,)),
    "SET_GPS_GLOBAL_ORIGIN cmd": (mav.MAV_CMD_DO_SET_GLOBAL_ORIGIN, (NAN, NAN, NAN, NAN, 47.3977, 8.5456, 488)),
    "EXTERNAL_POSITION_ESTIMATE": (mav.MAV_CMD_EXTERNAL_POSITION_ESTIMATE, (0, 0, 5, NAN, 47.3977, 8.5456, NAN)),
    "EXTERNAL_WIND_ESTIMATE": (mav.MAV_CMD_EXTERNAL_WIND_ESTIMATE, (3, 1, 90, 10)),
    "FIXED_MAG_CAL_YAW": (mav.MAV_CMD_FIXED_MAG_CAL_YAW, (0,)),
    "unknown 31999": (31999, ()),
}  # fmt: skip


def main() -> int:
    """Exit code 1 if something is missing without a reason, 2 without notes to compare with."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reference", type=Path, required=True, metavar="DIR", help="folder of the notes on both")
    parser.add_argument("--out", type=Path, default=OUT, metavar="FILE", help="[docs/mavlink-compared.md]")
    options = parser.parse_args()
    try:
        px4, ardupilot = read_px4(options.reference), read_ardupilot(options.reference)
    except NotesError as error:
        print(error, file=sys.stderr)
        return 2
    names = sorted(px4.requests.keys() | ardupilot.requests.keys())
    ours = measured_as_px4(names)
    theirs = measured_as_ardupilot(names)
    rows = tried_services()
    missing = [*missing_streams(px4, ours.streams), *missing_of_ardupilot(ardupilot, theirs.streams)]
    missing += missing_answers(px4, ardupilot, ours, theirs.requests)
    missing += [f"service {row.service}: {row.ours}" for row in rows if not row.answered]
    told = [f"{line} ({why})" if why else line for line in missing for why in [reason(line)]]
    text = "\n\n".join(
        [
            INTRODUCTION,
            "## What they do and this vehicle does not",
            "On purpose, with the reason beside it; what has none is a defect.",
            "\n".join(f"- {line}" for line in told),
            "## Streams as PX4 [Hz]",
            px4_streams(px4, ours.streams),
            "## Streams as ArduPilot [Hz]",
            ardupilot_streams(ardupilot, theirs.streams),
            "## REQUEST_MESSAGE",
            REQUESTS_NOTE,
            request_table(names, px4, ardupilot, ours.requests, theirs.requests),
            "## Commands, disarmed on the ground",
            command_table(px4, ours.commands),
            "## Services",
            table(
                ("service", "PX4", "ArduPilot", "ours"),
                ([row.service, row.px4, row.ardupilot, row.ours] for row in rows),
            ),
        ]
    )
    options.out.write_text(text + "\n")
    print(f"{options.out}: {len(missing)} things that they do and this vehicle does not", *told, sep="\n")
    return int(not all(map(reason, missing)))


class Measured(NamedTuple):
    """What our vehicle was seen to do as one of them: rates by situation, answers by message and by command."""

    streams: dict[str, dict[str, float]]
    requests: dict[str, Reply]
    commands: dict[str, Reply]


def measured_as_px4(names: Iterable[str]) -> Measured:
    """Streams on the ground and in flight, requests in flight, commands on the ground."""
    links = ("normal", "onboard", "viewer")
    with Probe(streams=links) as probe:
        streams = {f"disarmed {link}": rates for link, rates in probe.rates(SECONDS).items()}
        commands = {name: probe.command(number, *params) for name, (number, params) in COMMANDS.items()}
    with Probe(FLYING, streams=links, asks=QUIET) as probe:
        streams |= {f"fixed wing {link}": rates for link, rates in probe.rates(SECONDS).items()}
        requests = probe.requests(names)
    return Measured(streams, requests, commands)


def measured_as_ardupilot(names: Iterable[str]) -> Measured:
    """Streams that nobody asked for, and those of REQUEST_DATA_STREAM; requests."""
    with Probe(FLYING, "--identity=ardupilot") as probe:
        streams = {"default": probe.rates(SECONDS)[""]}
        for rate, seconds in ((4, SECONDS), (50, FASTEST_SECONDS)):
            probe.station.send("REQUEST_DATA_STREAM", req_stream_id=0, req_message_rate=rate, start_stop=1)
            probe.wait(0.5)
            streams[f"all {rate}"] = probe.rates(seconds)[""]
    with Probe(FLYING, "--identity=ardupilot", asks=QUIET) as probe:
        return Measured(streams, probe.requests(names), {})


def tried_services() -> list[Row]:
    """On the ground, after a moment with the motors armed, so that there is a log."""
    port = free_port()
    with tempfile.TemporaryDirectory() as state, Probe(f"--link=udpin:{port}", "--state", state) as probe:
        for armed in (1.0, 0.0):
            probe.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, armed)
            probe.wait(1.0)
        return services(probe, port)


def reason(missing: str) -> str:
    """Why this is missing, if there is a reason."""
    return next((why for beginning, why in ON_PURPOSE.items() if missing.startswith(beginning)), "")


# -- what is missing ---------------------------------------------------------------------------------------------------


def missing_streams(px4: Px4Profile, ours: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Streams of PX4's that ours has not, or has at less than nine tenths of the rate."""
    found: dict[str, str] = {}
    for situation, rates in px4.streams.items():
        for name, rate in rates.items():
            own = ours[situation].get(name, 0.0)
            if name not in OCCASIONAL and own < ENOUGH * rate:
                found.setdefault(name, f"stream {name}, {situation}: PX4 {rate:g} Hz, ours {own:.2g} Hz")
    return list(found.values())


def missing_of_ardupilot(ardupilot: ArdupilotProfile, ours: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Streams of ArduPilot's that ours has not, or has at less than nine tenths of the rate."""
    found: dict[str, str] = {}
    for name, rates in ardupilot.streams.items():
        for situation, rate in zip(("default", "all 4", "all 50"), rates, strict=True):
            own = ours[situation].get(name, 0.0)
            if name not in OCCASIONAL and own < ENOUGH * rate:
                found.setdefault(name, f"stream {name}, {situation}: ArduPilot {rate:g} Hz, ours {own:.2g} Hz")
    return list(found.values())


def missing_answers(
    px4: Px4Profile, ardupilot: ArdupilotProfile, ours: Measured, as_ardupilot: Mapping[str, Reply]
) -> list[str]:
    """Messages that one of them sends on request and ours does not; commands that PX4 takes and ours does not."""
    found = [
        f"REQUEST_MESSAGE {name}: PX4 sends it"
        for name, (_, came) in px4.requests.items()
        if came and not ours.requests[name].came
    ]
    found += [
        f"REQUEST_MESSAGE {name}: ArduPilot sends it"
        for name, kind in ardupilot.requests.items()
        if kind == ANSWERED and not as_ardupilot[name].came
    ]
    return found + [
        f"command {name}: PX4 {result}, ours {ours.commands[name].result}"
        for name, result in px4.commands.items()
        if result in TAKEN and ours.commands[name].result not in TAKEN
    ]


# -- tables ------------------------------------------------------------------------------------------------------------


def px4_streams(px4: Px4Profile, ours: Mapping[str, Mapping[str, float]]) -> str:
    """One row a message, PX4 beside ours on each link, on the ground and in flight."""
    situations = list(px4.streams)
    names = sorted({name for rates in (*px4.streams.values(), *(ours[s] for s in situations)) for name in rates})
    head = ("message", *(text for situation in situations for text in (f"PX4 {situation}", "ours")))
    return table(
        head,
        (
            [name, *(_rate(rates.get(name)) for s in situations for rates in (px4.streams[s], ours[s]))]
            for name in names
        ),
    )


def ardupilot_streams(ardupilot: ArdupilotProfile, ours: Mapping[str, Mapping[str, float]]) -> str:
    """One row a message, ArduPilot beside ours."""
    situations = ("default", "all 4", "all 50")
    names = sorted(ardupilot.streams.keys() | {name for rates in ours.values() for name in rates})
    head = ("message", *(text for situation in situations for text in (f"ArduPilot {situation}", "ours")))
    nothing = (0.0, 0.0, 0.0)
    return table(
        head,
        (
            [
                name,
                *(
                    _rate(rate)
                    for index, situation in enumerate(situations)
                    for rate in (ardupilot.streams.get(name, nothing)[index], ours[situation].get(name))
                ),
            ]
            for name in names
        ),
    )


def request_table(
    names: Iterable[str],
    px4: Px4Profile,
    ardupilot: ArdupilotProfile,
    ours: Mapping[str, Reply],
    as_ardupilot: Mapping[str, Reply],
) -> str:
    """One row a message."""

    def told(name: str) -> str:
        if name not in px4.requests:
            return ""
        result, came = px4.requests[name]
        return "sent" if came else result.lower()

    return table(
        ("message", "PX4", "ArduPilot", "ours as PX4", "ours as ArduPilot"),
        (
            [name, told(name), ardupilot.requests.get(name, ""), _answer(ours[name]), _answer(as_ardupilot[name])]
            for name in names
        ),
    )


def command_table(px4: Px4Profile, ours: Mapping[str, Reply]) -> str:
    """One row a command, with the time that our acknowledgement took."""
    return table(
        ("command", "PX4", "ours", "after"),
        (
            [name, result or "no answer", ours[name].result, f"{ours[name].seconds * 1e3:.1f} ms"]
            for name, result in px4.commands.items()
        ),
    )


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """In Markdown."""
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _rate(rate: float | None) -> str:
    return f"{rate:.3g}" if rate else ""


def _answer(reply: Reply) -> str:
    return "sent" if reply.came else reply.result.lower()


if __name__ == "__main__":
    sys.exit(main())
