"""`fly_mission` with real vehicles that look like PX4, ArduPilot and neither, flown at many times real time."""

import json
import re
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.connection import connect
from gcs_scripts.fly_mission import main

Vehicle = Callable[..., AbstractContextManager[str]]
Wire = Callable[[int, float], AbstractContextManager[tuple[int, list[int]]]]
Port = Callable[[], int]
Capture = pytest.CaptureFixture[str]

HOME = (47.397742, 8.545594)
NORTH_30M = 47.398012


def item(command: int, *params: float | None, place: tuple[float, float, float] | None = None) -> dict[str, Any]:
    filled = [*params, *[0] * (4 - len(params)), *(place or (0, 0, 0))]
    frame = mav.MAV_FRAME_MISSION if place is None else mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
    return {"type": "SimpleItem", "command": command, "frame": frame, "params": filled, "autoContinue": True}


TAKE_OFF = item(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, None, place=(*HOME, 10))
HOVER = item(mav.MAV_CMD_DO_VTOL_TRANSITION, mav.MAV_VTOL_STATE_MC)
AWAY = item(mav.MAV_CMD_NAV_WAYPOINT, 0, 0, 0, None, place=(NORTH_30M, HOME[1], 10))
WAIT = item(mav.MAV_CMD_NAV_DELAY, 600)
LAND = item(mav.MAV_CMD_NAV_VTOL_LAND, 0, 0, 0, None, place=(NORTH_30M, HOME[1], 0))


@pytest.fixture
def plan(tmp_path: Path) -> Callable[..., str]:
    """Writes a plan with these items, a fence of 500 m around home and a rally point, and gives its path."""

    def write(*items: dict[str, Any]) -> str:
        file = tmp_path / "some.plan"
        content = {
            "fileType": "Plan",
            "mission": {"plannedHomePosition": [*HOME, 488], "items": items},
            "geoFence": {"circles": [{"circle": {"center": HOME, "radius": 500}, "inclusion": True}]},
            "rallyPoints": {"points": [[NORTH_30M, HOME[1], 20]]},
        }
        file.write_text(json.dumps(content))
        return str(file)

    return write


@pytest.mark.parametrize("identity", ["px4", "ardupilot", "generic"])
def test_a_plan_is_flown_until_the_vehicle_has_landed_and_disarmed(
    vehicle: Vehicle, plan: Callable[..., str], capsys: Capture, identity: str
) -> None:
    with vehicle("--identity", identity, "--speed", "30") as link:
        assert main([plan(TAKE_OFF, AWAY, LAND), "--connect", link, "--within", "100"]) == 0, capsys.readouterr().err
        with connect(link) as craft:
            assert not craft.armed
            landed = craft.ask(
                lambda: craft.request("EXTENDED_SYS_STATE"), "EXTENDED_SYS_STATE", lambda _: True, "not told"
            )
            assert landed.landed_state == mav.MAV_LANDED_STATE_ON_GROUND
            place = craft.ask(
                lambda: craft.request("GLOBAL_POSITION_INT"), "GLOBAL_POSITION_INT", lambda _: True, "not told"
            )
            assert place.lat * 1e-7 == pytest.approx(NORTH_30M, abs=2e-5)  # 2 m
    said = capsys.readouterr().out
    assert "geofence sent: 1 item\nrally points sent: 1 item\nmission sent: 3 items\n" in said
    assert re.search(r"item 3 of 3: NAV_VTOL_LAND\n(.*\n)*landed and disarmed after \d+ s\n$", said)


def test_with_upload_only_the_three_lists_are_there_and_nothing_moves(
    vehicle: Vehicle, plan: Callable[..., str], capsys: Capture
) -> None:
    with vehicle("--identity", "ardupilot") as link:
        assert main([plan(TAKE_OFF, AWAY), "--connect", link, "--upload-only"]) == 0, capsys.readouterr().err
        with connect(link) as craft:
            for mission_type, count in ((0, 3), (1, 1), (2, 1)):  # ArduPilot's mission begins with home
                answer = craft.ask(
                    lambda kind=mission_type: craft.send.mission_request_list_send(1, 1, kind),
                    "MISSION_COUNT",
                    lambda m, kind=mission_type: m.mission_type == kind,
                    "no count",
                )
                assert answer.count == count
                craft.send.mission_ack_send(1, 1, 0, mission_type)
            assert not craft.armed


def test_a_plan_that_the_vehicle_refuses_is_one_line_with_the_reason(
    vehicle: Vehicle, plan: Callable[..., str], capsys: Capture
) -> None:
    outside = item(mav.MAV_CMD_NAV_WAYPOINT, 0, 0, 0, None, place=(HOME[0] + 0.01, HOME[1], 10))
    with vehicle() as link:
        assert main([plan(TAKE_OFF, outside, LAND), "--connect", link]) == 3
        with connect(link) as craft:
            assert not craft.armed
    said = capsys.readouterr().err
    assert re.fullmatch(r"fly_mission: system 1 refuses the mission: \w+ \(.*fence.*\)\n", said, re.IGNORECASE), said


def test_a_plan_that_would_stay_in_the_air_is_refused_unless_its_last_item_is_the_end(
    vehicle: Vehicle, plan: Callable[..., str], capsys: Capture
) -> None:
    file = plan(TAKE_OFF, AWAY)
    assert main([file]) == 2
    assert "neither a landing nor a return" in capsys.readouterr().err
    with vehicle("--speed", "30") as link:
        code = main([file, "--connect", link, "--until", "finished", "--within", "100"])
        assert code == 0, capsys.readouterr().err
        with connect(link) as craft:
            assert craft.armed
    assert "finished, at item 2 of 2" in capsys.readouterr().out


def test_a_flight_that_takes_too_long_is_told_from_a_lost_link(
    vehicle: Vehicle, plan: Callable[..., str], capsys: Capture
) -> None:
    with vehicle("--speed", "10") as link:
        assert main([plan(TAKE_OFF, HOVER, WAIT, LAND), "--connect", link, "--within", "3"]) == 5
    assert re.search(r"not over after 3 s: at item \d of 4 in MISSION; it goes on", capsys.readouterr().err)
    with vehicle("--speed", "10", "--duration", "30") as link:  # the process ends in the middle of the flight
        assert main([plan(TAKE_OFF, HOVER, WAIT, LAND), "--connect", link, "--timeout", "3"]) == 4
    assert re.search(r"has fallen silent: .* it was at item \d of 4 in MISSION", capsys.readouterr().err)


def test_a_vehicle_that_lands_without_its_mission_is_no_success(
    vehicle: Vehicle, plan: Callable[..., str], free_port: Port, capsys: Capture
) -> None:
    other = free_port()
    with vehicle("--speed", "20", "--link", f"udpout:127.0.0.1:{other}") as link:
        codes: list[int] = []
        arguments = [plan(TAKE_OFF, HOVER, WAIT, LAND), "--connect", link, "--within", "200"]
        flight = threading.Thread(target=lambda: codes.append(main(arguments)))
        flight.start()
        with connect(f"udpin:127.0.0.1:{other}", timeout=60.0) as pilot:
            pilot.ask(lambda: None, "MISSION_CURRENT", lambda current: current.seq == 2, "mission does not begin")
            flags = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            pilot.command(mav.MAV_CMD_DO_SET_MODE, flags, 4, 5, name="the mode RTL")
            flight.join(60.0)
    assert codes == [6]
    said = capsys.readouterr()
    assert "mode RTL" in said.out
    assert re.search(r"has disarmed at item 3 of 4 in \w+, before item 4 was reached", said.err)


def test_a_third_of_all_datagrams_may_be_lost(
    vehicle: Vehicle, plan: Callable[..., str], lossy_wire: Wire, free_port: Port, capsys: Capture
) -> None:
    port = free_port()
    file = plan(TAKE_OFF, HOVER, *[AWAY] * 20, LAND)
    with lossy_wire(port, 0.33) as (wire, dropped), vehicle("--speed", "40", link=f"udpin:127.0.0.1:{port}"):
        link = f"udpout:127.0.0.1:{wire}"
        assert main([file, "--connect", link, "--within", "100"]) == 0, capsys.readouterr().err
    assert dropped[0] > 100
