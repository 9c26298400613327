"""The console over SERIAL_CONTROL, used as MAVSDK, MAVProxy and QGroundControl use PX4's."""

import random
from importlib.metadata import version

import pytest

from sitl.flight.mission_items import Command, MissionItem
from sitl.mavlink.dialect import tiltwing as mav
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk, Station

SHELL = mav.SERIAL_CONTROL_DEV_SHELL
RESPOND, MULTI, EXCLUSIVE = (
    mav.SERIAL_CONTROL_FLAG_RESPOND, mav.SERIAL_CONTROL_FLAG_MULTI, mav.SERIAL_CONTROL_FLAG_EXCLUSIVE,
)  # fmt: skip


def type_in(station: Station, text: str | bytes, flags: int = RESPOND, device: int = SHELL) -> None:
    data = text.encode() if isinstance(text, str) else text
    station.send("SERIAL_CONTROL", device=device, flags=flags, count=len(data), data=list(data))


def said(station: Station) -> str:
    """All that the console has said to a station."""
    replies = station.of("SERIAL_CONTROL")
    assert all(reply.device == SHELL and reply.flags & mav.SERIAL_CONTROL_FLAG_REPLY for reply in replies)
    assert all(0 < reply.count <= 70 for reply in replies)
    return "".join(bytes(reply.data[: reply.count]).decode("ascii") for reply in replies)


def answer(desk: Desk, line: str) -> str:
    """What the console says to a line, between its echo and the next prompt."""
    before = len(said(desk.station))
    type_in(desk.station, f"{line}\n")
    desk.wait(0.5)
    transcript = said(desk.station)[before:].removeprefix("nsh> ")
    assert transcript.startswith(f"{line}\n")
    assert transcript.endswith("\nnsh> ")
    return transcript[len(line) + 1 : -len("nsh> ")]


# -- the line ------------------------------------------------------------------------------------------------------


def test_the_first_word_brings_a_prompt_and_each_line_is_echoed_and_answered(desk: Desk) -> None:
    type_in(desk.station, "\n")
    assert said(desk.station) == "nsh> \nnsh> "
    type_in(desk.station, "tilt\n")
    assert said(desk.station) == ("nsh> \nnsh> tilt\nTilt: 90.0 deg, command 90.0 deg (0 cruise, 90 hover)\nnsh> ")


def test_mavproxy_polls_and_ends_lines_with_both_characters(desk: Desk) -> None:
    type_in(desk.station, "tilt\r\n", RESPOND | MULTI)
    once = said(desk.station)
    assert once.count("nsh> ") == 2
    for _ in range(5):
        type_in(desk.station, "", RESPOND | MULTI)
    assert said(desk.station) == once


def test_qgroundcontrol_opens_with_an_empty_exclusive_message(desk: Desk) -> None:
    type_in(desk.station, "", RESPOND | MULTI | EXCLUSIVE)
    assert said(desk.station) == "nsh> "
    type_in(desk.station, "help\n", RESPOND | MULTI | EXCLUSIVE)
    desk.wait(0.1)
    assert "param" in said(desk.station)


def test_a_line_longer_than_a_message_comes_in_pieces_of_which_mavsdk_wants_the_last_answered(desk: Desk) -> None:
    line = f"listener vehicle_attitude{' ' * 100}\n"
    type_in(desk.station, line[:70], 0)
    assert said(desk.station) == ""
    type_in(desk.station, line[70:])
    desk.wait(0.1)
    assert f"nsh> {line}TOPIC: vehicle_attitude\n" in said(desk.station)


def test_what_was_typed_can_be_taken_back(desk: Desk) -> None:
    type_in(desk.station, "tilx\x7ft\n")
    assert said(desk.station).startswith("nsh> tilx\b \bt\nTilt: ")
    type_in(desk.station, "reboot\x03tilt\n")
    assert said(desk.station).count("Tilt: ") == 2


def test_each_sender_has_a_line_of_his_own(desk: Desk) -> None:
    other = desk.join(system=200)
    type_in(desk.station, "ti")
    type_in(other, "ver\n")
    type_in(desk.station, "lt\n")
    assert said(desk.station).startswith("nsh> tilt\nTilt: ")
    assert said(other).startswith("nsh> ver\nHW arch: ")


def test_answers_come_in_full_messages_to_the_asker_only(desk: Desk) -> None:
    other = desk.join(system=200)
    text = answer(desk, "param show")
    assert text.count("\n") == len(desk.simulation.flight.parameters.names())
    counts = [reply.count for reply in desk.of("SERIAL_CONTROL")]
    assert counts.count(70) > len(counts) * 0.9
    assert [message for message in other.of("SERIAL_CONTROL") if message.flags & 1] == []


def test_a_full_socket_gets_the_rest_later(desk: Desk) -> None:
    desk.station.full = True
    type_in(desk.station, "param show\n")
    desk.wait(1.0)
    desk.station.full = False
    desk.wait(1.0)
    assert said(desk.station).count("\n") == len(desk.simulation.flight.parameters.names()) + 1


@pytest.mark.parametrize(
    ("device", "flags"),
    [(mav.SERIAL_CONTROL_DEV_TELEM1, RESPOND), (100, RESPOND), (SHELL, RESPOND | mav.SERIAL_CONTROL_FLAG_REPLY)],
)
def test_other_devices_and_replies_of_others_are_not_answered(desk: Desk, device: int, flags: int) -> None:
    type_in(desk.station, "ver\n", flags, device)
    assert desk.of("SERIAL_CONTROL") == []


def test_a_line_without_end_and_output_that_nobody_fetches_stay_bounded(desk: Desk) -> None:
    for _ in range(50):
        type_in(desk.station, "x" * 70)
    type_in(desk.station, "\n")
    desk.wait(0.1)
    assert said(desk.station).endswith("line: expected at most 200 characters\nnsh> ")
    lazy = desk.join(system=200)
    for _ in range(100):
        type_in(lazy, "param show\n", 0)
    type_in(lazy, "")
    desk.wait(5.0)
    assert 60_000 < len(said(lazy)) <= 1 << 16


def test_whatever_bytes_come_the_vehicle_flies_on_as_if_nothing_had_been_said() -> None:
    desks = [Desk(Simulation(start="trim:20")) for _ in range(2)]
    noise = random.Random(1)
    for _ in range(500):
        type_in(desks[0].station, noise.randbytes(noise.randrange(71)), noise.randrange(256))
        desks[0].send("SERIAL_CONTROL", device=SHELL, flags=2, count=255, data=[10] * 70)
    for desk in desks:
        desk.advance(1.0)
        assert desk.face.internal_errors == 0
        desk.close()
    assert desks[0].simulation.state.tobytes() == desks[1].simulation.state.tobytes()


# -- the commands --------------------------------------------------------------------------------------------------


def test_help_names_every_command_and_none_of_them_fails(desk: Desk) -> None:
    names = [line.split()[0] for line in answer(desk, "help").splitlines()]
    assert names == sorted(names)
    assert {"ver", "param", "status", "mission", "top", "reboot", "tilt", "listener"} <= set(names)
    for name in set(names) - {"reboot"}:
        assert answer(desk, name) != ""
    assert desk.face.internal_errors == 0


def test_an_unknown_command_is_answered_with_where_to_look(desk: Desk) -> None:
    assert answer(desk, "uorb top") == "uorb: command not found, `help` lists all\n"


def test_ver_all_says_what_this_is(desk: Desk) -> None:
    text = answer(desk, "ver all")
    assert "HW arch: SITL\n" in text
    assert f"FW version: tiltwing-sitl {version('tiltwing-sitl')}\n" in text


def test_parameters_can_be_shown_set_and_reset(desk: Desk) -> None:
    parameters = desk.simulation.flight.parameters
    assert answer(desk, "param show RTL_RETURN_ALT") == "RTL_RETURN_ALT: 40 m\n"
    shown = [line.partition(":")[0] for line in answer(desk, "param show rtl_*").splitlines()]
    assert shown == [name for name in parameters.names() if name.startswith("RTL_")]
    assert answer(desk, "param set RTL_RETURN_ALT 55.5") == "RTL_RETURN_ALT: 55.5 m\n"
    assert parameters["RTL_RETURN_ALT"] == 55.5
    assert answer(desk, "param set wv_en 1") == "WV_EN: 1\n"
    assert answer(desk, "param reset RTL_RETURN_ALT") == "RTL_RETURN_ALT: 40 m\n"
    assert parameters["RTL_RETURN_ALT"] == 40.0


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("param set RTL_RETURN_ALT 1e9", "param: RTL_RETURN_ALT: expected 5 to 150 m, got 1000000000.0\n"),
        ("param set RTL_RETURN_ALT nan", "param: RTL_RETURN_ALT: expected 5 to 150 m, got nan\n"),
        ("param set WV_EN 0.5", "param: expected a number for WV_EN, got 0.5\n"),
        ("param set RTL_RETURN_ALT high", "param: expected a number for RTL_RETURN_ALT, got high\n"),
        ("param set RTL_RETURN_ALTI 5", "param: RTL_RETURN_ALTI: unknown parameter, expected RTL_RETURN_ALT"),
        ("param", "param: expected show [NAME with * and ?] | set NAME VALUE | reset NAME\n"),
        ("listener nonsense", "listener: expected one of actuator_outputs, "),
        ("commander mode nonsense", "commander: expected mode manual | stabilized | "),
        ("commander land", "commander: cannot land: on the ground\n"),
        ("commander fly", "commander: expected status | arm"),
    ],
)
def test_what_cannot_be_done_is_answered_with_one_line_that_says_why(desk: Desk, line: str, expected: str) -> None:
    text = answer(desk, line)
    assert text.startswith(expected)
    assert text.count("\n") == 1


def test_topics_show_the_vehicles_state(desk: Desk) -> None:
    desk.advance(1.5)
    topics = answer(desk, "listener").split()
    for topic in topics:
        text = answer(desk, f"listener {topic}")
        assert text.startswith(f"TOPIC: {topic}\n    timestamp: 1500000\n")
    assert "    mode: HOLD\n" in answer(desk, "listener vehicle_status")
    assert "    lat: 47.3977420\n" in answer(desk, "listener vehicle_global_position")


def test_the_pilot_can_arm_take_off_and_land_from_the_console(desk: Desk) -> None:
    desk.advance(1.0)
    assert answer(desk, "commander arm").startswith("Armed, mode Hold")
    answer(desk, "commander takeoff")
    desk.until(lambda: desk.simulation.flight.height > 5.0)
    assert answer(desk, "reboot") == "reboot: only while disarmed\n"
    assert "in air" in answer(desk, "commander status") or "takeoff" in answer(desk, "commander status")
    answer(desk, "commander land")
    desk.until(lambda: not desk.simulation.flight.armed, timeout=120.0)
    assert "Disarmed" in answer(desk, "dmesg")


def test_the_mission_is_listed_with_how_far_it_has_got(desk: Desk) -> None:
    assert answer(desk, "mission") == "No mission\n"
    items = [
        MissionItem(Command.VTOL_TAKEOFF, x=47.398, y=8.546, z=20.0),
        MissionItem(Command.VTOL_LAND, x=47.398, y=8.546),
    ]
    desk.simulation.flight.load_mission(items)
    assert answer(desk, "mission") == "2 items, at item 0\n0: command 84\n1: command 85\n"


def test_reboot_begins_anew_while_disarmed(desk: Desk) -> None:
    desk.advance(5.0)
    type_in(desk.station, "reboot\n")
    desk.turn()
    assert desk.simulation.time < 1.0
    assert answer(desk, "tilt").startswith("Tilt: ")


def test_without_an_autopilot_what_needs_it_says_so_and_the_rest_works() -> None:
    desk = Desk(Simulation(autopilot=False))
    for line in ("param show", "commander arm", "mission", "dmesg"):
        assert answer(desk, line).endswith("the autopilot is off\n")
    for line in ("status", "tilt", "ver all", "top", "mavlink status", "listener vehicle_status"):
        assert "autopilot is off" not in answer(desk, line)
    desk.close()
