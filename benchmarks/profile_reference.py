"""What PX4 and ArduPilot were measured to send and answer: read from the notes of whoever ran them.

The notes are no part of this project: `px4-profile.json` and `ardupilot-on-the-wire.md`, in one folder.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path

__all__ = ["ArdupilotProfile", "NotesError", "Px4Profile", "read_ardupilot", "read_px4"]

ANSWERED, SILENT, FAILED = "answered", "accepted, nothing sent", "failed"


class NotesError(ValueError):
    """Notes that are not there, or say something else than expected; one line says which and what."""


@dataclass(frozen=True)
class Px4Profile:
    """PX4's side of the tables.

    Attributes:
        streams: rates [Hz] by message, of each state and link ("disarmed onboard").
        requests: result of REQUEST_MESSAGE by message, and whether the message came.
        commands: result of each command by the name it has in the notes; None: no answer.
        parameters: how many, and seconds for the list.
    """

    streams: dict[str, dict[str, float]]
    requests: dict[str, tuple[str, bool]]
    commands: dict[str, str | None]
    parameters: tuple[int, float]


@dataclass(frozen=True)
class ArdupilotProfile:
    """ArduPilot's side.

    Attributes:
        streams: rates [Hz] by message: by default, and after REQUEST_DATA_STREAM of all at 4 and at 50 Hz.
        requests: ANSWERED, SILENT or FAILED by message.
    """

    streams: dict[str, tuple[float, float, float]]
    requests: dict[str, str]


def read_px4(folder: Path) -> Px4Profile:
    """Raises NotesError."""
    path = folder / "px4-profile.json"
    try:
        notes = json.loads(path.read_text())
        links = {"normal": "gcs_normal_14550", "onboard": "onboard_14540", "viewer": "sih_viewer_19410"}
        states = {"disarmed": "streams_disarmed_20s", "fixed wing": "streams_fixed_wing_20s"}
        return Px4Profile(
            streams={
                f"{state} {link}": notes[state_key][link_key]["hz"]
                for state, state_key in states.items()
                for link, link_key in links.items()
            },
            requests={name: (_short(was["ack"]), was["message"]) for name, was in notes["request_message"].items()},
            commands={name: was and _short(was["result"]) for name, was in notes["commands"].items()},
            parameters=(notes["params"]["received"], notes["params"]["list_s"]),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise NotesError(f"{path}: expected a profile of PX4, got {type(error).__name__} {error}") from None


def read_ardupilot(folder: Path) -> ArdupilotProfile:
    """Raises NotesError."""
    path = folder / "ardupilot-on-the-wire.md"
    try:
        text = path.read_text()
    except OSError as error:
        raise NotesError(f"{path}: expected notes on ArduPilot, got {error}") from None
    rows = re.findall(r"^\| ([A-Z][A-Z0-9_]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| \d+ \|$", text, re.MULTILINE)
    answers = re.search(
        r"REQUEST_MESSAGE answered: (.*?)\. ACCEPTED but silent[^:]*: (.*?)\. FAILED\(4\): (.*?)\.$", text, re.MULTILINE
    )
    if not rows or answers is None:
        raise NotesError(f"{path}: expected a table of rates and a list of requests, found {len(rows)} rates")
    return ArdupilotProfile(
        streams={name: (float(default), float(at_4), float(at_50)) for name, default, at_4, at_50 in rows},
        requests={
            name: kind
            for kind, names in zip((ANSWERED, SILENT, FAILED), answers.groups(), strict=True)
            for name in names.split(", ")
        },
    )


def _short(result: str) -> str:
    return result.removeprefix("MAV_RESULT_")
