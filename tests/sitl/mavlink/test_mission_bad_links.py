"""Transfers on links that lose, copy, delay and reorder, and stations that send anything: never half a plan."""

import math
import random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sitl.mavlink.codec import codec
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.identity import ARDUPILOT, PX4
from tests.sitl.mavlink.in_memory import Desk, Station
from tests.sitl.mavlink.plan_station import (
    FENCE,
    MISSION,
    RALLY,
    Transfer,
    fence,
    fetched,
    item,
    mission,
    rally,
    same_items,
    sent,
)

ACCEPTED = mav.MAV_MISSION_ACCEPTED
OLD = {MISSION: mission(1), FENCE: fence(3), RALLY: rally(1)}
NEW = {MISSION: mission(13), FENCE: fence(14), RALLY: rally(15)}


def lossy(desk: Desk, seed: int, system: int = 255, *, delay: float = 0.5) -> Station:
    """30 % lost and 20 % copied each way, half a second late and out of order."""
    station = desk.join(system)
    station.random = random.Random(seed)
    station.loss, station.duplicates, station.delay, station.reordering = 0.3, 0.2, delay, 0.5
    return station


@pytest.mark.parametrize("kind", [MISSION, FENCE, RALLY])
def test_an_upload_on_a_bad_link_brings_the_whole_plan_or_none_of_it(kind: int) -> None:
    completed = 0
    for seed in range(12):
        desk = Desk()
        good = desk.join(1)
        sent(good, OLD[kind], kind)
        result = Transfer(lossy(desk, seed), kind, NEW[kind]).run()
        desk.wait(5.0)  # until the vehicle has given up, too
        held = fetched(good, kind)
        if result == ACCEPTED:
            completed += 1
            assert same_items(held, NEW[kind])
        else:
            assert result in (mav.MAV_MISSION_OPERATION_CANCELLED, "timeout")
            assert same_items(held, OLD[kind]) or (result == "timeout" and same_items(held, NEW[kind]))
        assert desk.face.internal_errors == 0
        desk.close()
    assert completed >= 10


def test_a_download_on_a_bad_link_brings_what_is_there(desk: Desk) -> None:
    completed = 0
    for kind, items in NEW.items():
        sent(desk.station, items, kind)
        for seed in range(4):
            transfer = Transfer(lossy(desk, seed, 100 + seed), kind)
            result = transfer.run()
            assert result in (ACCEPTED, "timeout")
            assert same_items(transfer.items, items[: len(transfer.items)])
            if result == ACCEPTED:
                completed += 1
                assert len(transfer.items) == len(items)
    assert completed >= 10


def test_two_stations_on_bad_links_at_once_leave_one_whole_plan() -> None:
    for seed in range(8):
        desk = Desk()
        good = desk.join(1)
        plans = (mission(9), mission(12))
        transfers = [
            Transfer(lossy(desk, 10 * seed + which, 240 + which, delay=0.05), MISSION, plan)
            for which, plan in enumerate(plans)
        ]
        end = desk.wall + 600.0
        while any(transfer.result is None for transfer in transfers):
            assert desk.wall < end
            desk.wait(0.005)
            for transfer in transfers:
                transfer.step()
        desk.wait(5.0)
        accepted = [plan for plan, transfer in zip(plans, transfers, strict=True) if transfer.result == ACCEPTED]
        held = fetched(good)
        if accepted:
            assert any(same_items(held, plan) for plan in accepted)
        else:
            assert any(same_items(held, plan) for plan in ((), *plans))
        desk.close()


NAMES = (
    "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_ACK", "MISSION_REQUEST_LIST", "MISSION_REQUEST_INT",
    "MISSION_REQUEST", "MISSION_REQUEST_PARTIAL_LIST", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL",
    "MISSION_SET_CURRENT",
)  # fmt: skip
GOOD_ITEMS = [*mission(3), *fence(3), *rally(2), item(177, frame=2, param1=1, param2=1), item(5000, frame=0)]
numbers = st.sampled_from([0, 0, 0, 1, 1, 2, 3, 4, 0xFFFF])
single = st.floats(width=32)
any_item = st.fixed_dictionaries({
    "command": st.one_of(st.sampled_from([16, 22, 85, 177, 178, 179, 5000, 5001, 5003, 5100]), st.integers(0, 0xFFFF)),
    "frame": st.one_of(st.sampled_from([0, 2, 3, 6]), st.integers(0, 255)),
    "autocontinue": st.integers(0, 255),
    "param1": single, "param2": single, "param3": single, "param4": single, "z": single,
    "x": st.integers(-(2**31), 2**31 - 1), "y": st.integers(-(2**31), 2**31 - 1),
})  # fmt: skip
action = st.fixed_dictionaries({
    "station": st.integers(0, 1),
    "name": st.sampled_from(NAMES),
    "kind": st.sampled_from([0, 0, 0, 1, 1, 2, 3, 255]),
    "seq": numbers,
    "end": st.sampled_from([-1, 0, 1, 2, 5]),
    "current": st.sampled_from([0, 0, 0, 1, 2, 3]),
    "type": st.sampled_from([0, 0, 3, 15, 200]),
    "item": st.one_of(st.sampled_from(GOOD_ITEMS), any_item),
    "coordinates": st.tuples(single, single),
    "follows": st.booleans(),
    "pause": st.sampled_from([0.0, 0.0, 0.0, 0.3, 3.0]),
})  # fmt: skip


def perform(desk: Desk, stations: tuple[Any, Any], chosen: dict[str, Any]) -> None:
    """Send one arbitrary message; where it says `follows`, with the number that the vehicle has asked for."""
    station, name, kind, seq = stations[chosen["station"]], chosen["name"], chosen["kind"], chosen["seq"]
    asked = [m for m in station.received if m.get_type() in ("MISSION_REQUEST_INT", "MISSION_REQUEST")]
    fields: dict[str, Any] = {"mission_type": kind}
    if name in ("MISSION_ITEM_INT", "MISSION_ITEM"):
        fields |= chosen["item"] | {"seq": seq, "current": chosen["current"]}
        if chosen["follows"] and asked:
            fields |= {"seq": asked[-1].seq, "mission_type": asked[-1].mission_type, "current": 0}
        if name == "MISSION_ITEM":
            fields |= dict(zip("xy", chosen["coordinates"], strict=True))
    elif name == "MISSION_COUNT":
        fields["count"] = seq
    elif name == "MISSION_ACK":
        fields["type"] = chosen["type"]
    elif name.endswith("PARTIAL_LIST"):
        fields |= {"start_index": min(seq, 100), "end_index": chosen["end"]}
    elif name == "MISSION_SET_CURRENT":
        fields = {"seq": seq}
    elif name in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
        fields["seq"] = seq
    station.send(name, **fields)
    desk.wait(chosen["pause"])


@pytest.mark.parametrize("identity", [PX4, ARDUPILOT])
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(actions=st.lists(action, max_size=40))
def test_whatever_two_stations_send_a_plan_changes_only_as_a_whole_and_acknowledged(
    identity: Any, actions: list[dict[str, Any]]
) -> None:
    desk = Desk(WORLD.setdefault(identity.name, Desk().simulation), identity=identity)
    flight = desk.simulation.flight
    stations = (desk.station, desk.join(254))
    desk.send("MISSION_CLEAR_ALL", mission_type=255)
    for chosen in actions:
        before = flight.mission.items, flight.fence.polygons, flight.fence.circles, flight.rally.points
        acks = sum(m.type == ACCEPTED for station in stations for m in station.of("MISSION_ACK"))
        perform(desk, stations, chosen)
        after = flight.mission.items, flight.fence.polygons, flight.fence.circles, flight.rally.points
        if any(a is not b for a, b in zip(before, after, strict=True)):
            assert sum(m.type == ACCEPTED for station in stations for m in station.of("MISSION_ACK")) > acks
            assert not flight.mission.problems() or after[0] is before[0]
        assert desk.face.internal_errors == 0
    desk.advance(0.1)
    desk.send("MISSION_ACK", type=mav.MAV_MISSION_OPERATION_CANCELLED)
    for kind in (MISSION, FENCE, RALLY):
        for fields in fetched(stations[1], kind):
            assert not any(math.isinf(fields[f"param{number}"]) for number in range(1, 5))
    assert desk.face.internal_errors == 0
    desk.close()


WORLD: dict[str, Any] = {}  # one simulation for all examples: making one takes longer than an example


def test_any_values_in_any_mission_message_do_no_harm(desk: Desk) -> None:
    chance = random.Random(7)
    for _ in range(3000):
        packer = codec(chance.choice(NAMES))
        fields = packer.read(chance.randbytes(packer.size))._asdict()
        fields |= {"target_system": 1, "target_component": 1}
        if chance.random() < 0.7:
            fields |= {"mission_type": chance.randrange(3)} if "mission_type" in fields else {}
        desk.station.send_bytes(packer.frame(packer.payload_of(**fields), 0, 255, 190))
    assert desk.face.internal_errors == 0
