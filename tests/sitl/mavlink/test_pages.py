"""The pages about MAVLink say what the vehicle does: every message with its rates, every command, every mode."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from sitl.mavlink.codec import codec, codec_by_id
from sitl.mavlink.command import CommandService
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import ARDUPILOT, GENERIC, IDENTITIES, PX4
from sitl.mavlink.servo_outputs import servo_input_handlers
from sitl.mavlink.standard_modes import HEARTBEAT_PERIOD
from sitl.mavlink.telemetry.streams import DEFAULT_RATES
from tests.sitl.mavlink.in_memory import Desk

PAGES = Path(__file__).resolve().parents[3] / "docs" / "mavlink"
MESSAGES, COMMANDS, MODES = (
    (PAGES / name).read_text() for name in ("messages.md", "commands.md", "modes-and-setpoints.md")
)
SETS = ("normal", "onboard", "minimal", "ardupilot")  # columns of the tables of messages


@pytest.fixture(params=list(IDENTITIES.values()), ids=list(IDENTITIES))
def desk(request: pytest.FixtureRequest) -> Iterator[Desk]:
    desk = Desk(identity=request.param)
    yield desk
    desk.face.close()


def rows(page: str, columns: int) -> list[list[str]]:
    """Cells of all table rows with so many columns."""
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]
    return [row for row in cells if len(row) == columns]


def served(desk: Desk) -> set[str]:
    """Names of the messages that are taken."""
    servo_outputs = {codec_by_id(key).name for key in servo_input_handlers(desk.face.servo_input)}
    return servo_outputs.union(*(service.messages() for service in desk.face.services))


def names_in(text: str) -> set[str]:
    return set(re.findall(r"\b[A-Z][A-Z0-9_]+\b", text))


def test_every_message_that_can_be_streamed_is_there_with_the_rates_of_all_sets(desk: Desk) -> None:
    told = {row[0]: row[1:5] for row in rows(MESSAGES, 6) if row[0] != "message"}
    streamed = {codec_by_id(key).name for key in desk.face.streamed}
    assert set(told) == streamed
    for name in streamed - {"HEARTBEAT"}:
        rates = [DEFAULT_RATES[each].get(name) for each in SETS]
        assert told[name] == ["-" if rate is None else f"{rate:g}" for rate in rates], name
    assert told["HEARTBEAT"] == [f"{1.0 / HEARTBEAT_PERIOD:g}"] * len(SETS)


def test_the_sum_of_each_set_is_right_to_a_few_messages() -> None:
    sums = {
        row[0].strip("`"): float(re.findall(r"\d+", row[2])[0]) for row in rows(MESSAGES, 3) if row[0][1:-1] in SETS
    }
    assert set(sums) == set(SETS)
    for name, told in sums.items():
        assert told == pytest.approx(sum(DEFAULT_RATES[name].values()), abs=1.0), name


def test_every_message_sent_on_request_only_is_there(desk: Desk) -> None:
    told = names_in(MESSAGES.partition("## On request only")[2].partition("## As it happens")[0])
    assert {codec_by_id(key).name for key in desk.face.offered} - {
        codec_by_id(key).name for key in desk.face.streamed
    } <= told


def test_every_message_taken_is_there_and_no_other(desk: Desk) -> None:
    cells = [row[0] for row in rows(MESSAGES.partition("## Messages in")[2].partition("## TILT_STATUS")[0], 2)]
    told = {name for cell in cells for name in cell.split(", ")} - {"messages"}
    assert served(desk) <= told
    assert all(codec(name) for name in told)
    if desk.face.identity is ARDUPILOT:  # which takes some more than others
        assert told == served(desk)


def test_every_command_served_is_there_with_its_number_and_no_other(desk: Desk) -> None:
    told = {int(number): name for name, number in re.findall(r"\b([A-Z][A-Z0-9_]+) \((\d+)\)", COMMANDS)}
    commands = desk.face.service(CommandService).handlers
    assert set(commands) <= set(told)
    for number, name in told.items():
        assert mav.enums["MAV_CMD"][number].name == f"MAV_CMD_{name}"
    if desk.face.identity is ARDUPILOT:
        assert set(told) == set(commands)


def test_every_mode_is_there_with_its_numbers() -> None:
    told = {row[0]: row[1:] for row in rows(MODES, 5)}
    for entry in PX4.modes:
        main, sub = entry.number >> 16 & 0xFF, entry.number >> 24
        px4, ardupilot, generic, standard = told[entry.name]
        assert px4.partition(" (")[0] == (f"{main}, {sub}" if sub else f"{main}")
        assert int(generic) == next(one.number for one in GENERIC.modes if one.modes == entry.modes)
        also = {f"{one.number} {one.name}" for one in ARDUPILOT.modes if entry.modes[0] == one.modes[0]}
        assert also <= set(ardupilot.split(", "))
        name = mav.enums["MAV_STANDARD_MODE"][entry.standard].name.removeprefix("MAV_STANDARD_MODE_")
        assert standard == (f"{entry.standard} {name}" if entry.standard else "")
