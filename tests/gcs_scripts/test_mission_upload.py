"""Uploads to peers that do what this vehicle never does: ask as ArduPilot does, lose answers, give up, refuse."""

from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.connection import Vehicle, connect
from gcs_scripts.errors import RefusedError, UnansweredError
from gcs_scripts.mission_flight import MissionFlight
from gcs_scripts.mission_upload import upload
from gcs_scripts.plan_file import Item, Plan, wire_items

PeerStarter = Callable[..., AbstractContextManager[Any]]
MISSION = mav.MAV_MISSION_TYPE_MISSION
PLACE = Item(16, 3, (0, 0, 0, 0, 47.0, 8.0, 20.0))
ITEMS = wire_items([PLACE._replace(params=(*PLACE.params[:6], 20.0 + i)) for i in range(4)], MISSION)


class Receiver:
    """The vehicle's side of an upload: takes items one by one, as the guide has it, and as the test spoils it."""

    def __init__(self, peer: Any, request: str = "mission_request_int_send") -> None:
        self.items: list[float] = []
        self.counts: list[int] = []
        self.silent_acks = self.give_up_at = self.refuse = 0
        self._peer = peer
        self._request = getattr(peer.mav, request)
        peer.answer = self.answer

    def acknowledge(self, result: int) -> None:
        self._peer.mav.mission_ack_send(255, 190, result, MISSION)

    def answer(self, message: Any) -> None:
        kind = message.get_type()
        if kind == "MISSION_COUNT":
            self.counts.append(message.count)
            self.items.clear()
            self._request(255, 190, 0, MISSION)
            self._peer.mav.mission_request_int_send(42, 190, 3, MISSION)  # for another station
        elif kind == "MISSION_ITEM_INT" and message.seq == len(self.items):
            self.items.append(message.z)
            if self.give_up_at and len(self.items) == self.give_up_at:
                self.give_up_at = 0
                self.acknowledge(mav.MAV_MISSION_OPERATION_CANCELLED)
            elif self.refuse:
                self.acknowledge(self.refuse)
            elif len(self.items) < self.counts[-1]:
                self._request(255, 190, len(self.items), MISSION)
            else:
                self.finish()
        elif kind == "MISSION_ITEM_INT" and len(self.items) == self.counts[-1]:
            self.finish()

    def finish(self) -> None:
        self.silent_acks -= 1
        if self.silent_acks < 0:
            self.acknowledge(mav.MAV_MISSION_ACCEPTED)


@pytest.fixture
def pair(peer: PeerStarter, free_port: Callable[[], int]) -> Generator[tuple[Vehicle, Any]]:
    port = free_port()
    with peer(port) as other, connect(f"udpin:127.0.0.1:{port}") as craft:
        yield craft, other


@pytest.mark.parametrize("request_with", ["mission_request_int_send", "mission_request_send"])
def test_either_kind_of_request_gets_its_item(pair: tuple[Vehicle, Any], request_with: str) -> None:
    craft, other = pair
    receiver = Receiver(other, request_with)
    sent: list[int] = []
    upload(craft, ITEMS, MISSION, "the mission", sent.append)
    assert receiver.items == [20.0, 21.0, 22.0, 23.0]
    assert sent == [1, 2, 3, 4]


def test_a_lost_acknowledgement_is_got_by_the_last_item_again(pair: tuple[Vehicle, Any]) -> None:
    craft, other = pair
    receiver = Receiver(other)
    receiver.silent_acks = 2
    upload(craft, ITEMS, MISSION, "the mission")
    assert receiver.counts == [4]


def test_an_upload_that_the_vehicle_gave_up_is_begun_anew(pair: tuple[Vehicle, Any]) -> None:
    craft, other = pair
    receiver = Receiver(other)
    receiver.give_up_at = 3
    upload(craft, ITEMS, MISSION, "the mission")
    assert receiver.counts == [4, 4]
    assert receiver.items == [20.0, 21.0, 22.0, 23.0]


def test_a_refusal_has_the_result_and_no_answer_has_an_end(pair: tuple[Vehicle, Any]) -> None:
    craft, other = pair
    receiver = Receiver(other)
    receiver.refuse = mav.MAV_MISSION_INVALID_PARAM5_X
    with pytest.raises(RefusedError, match=r"^system 1 refuses the mission: INVALID_PARAM5_X$"):
        upload(craft, ITEMS, MISSION, "the mission")
    other.answer = lambda _: None
    craft.timeout = 1.0
    with pytest.raises(UnansweredError, match="does not take the mission"):
        upload(craft, ITEMS, MISSION, "the mission")


def test_ardupilots_copters_are_armed_in_guided_and_then_told_to_start_the_mission(
    peer: PeerStarter, free_port: Callable[[], int]
) -> None:
    port = free_port()
    with peer(port, autopilot=mav.MAV_AUTOPILOT_ARDUPILOTMEGA) as other, connect(f"udpin:127.0.0.1:{port}") as craft:
        done: list[tuple[int, float]] = []

        def answer(message: Any) -> None:
            if message.get_type() != "COMMAND_LONG" or message.command == mav.MAV_CMD_SET_MESSAGE_INTERVAL:
                return
            if message.command == mav.MAV_CMD_COMPONENT_ARM_DISARM:
                if not any(command == message.command for command, _ in done):  # not ready at first
                    other.mav.sys_status_send(mav.MAV_SYS_STATUS_PREARM_CHECK, 0, 0, 0, 0, -1, -1, 0, 0, 0, 0, 0, 0)
                    other.mav.command_ack_send(message.command, mav.MAV_RESULT_FAILED, 0, 0, 255, 190)
                    done.append((message.command, message.param1))
                    return
                other.armed = True
            if message.command == mav.MAV_CMD_DO_SET_MODE:
                other.custom_mode = int(message.param2)
            if (message.command, message.param2) not in done[-1:]:
                done.append((message.command, message.param2))
            other.mav.command_ack_send(message.command, mav.MAV_RESULT_ACCEPTED, 0, 0, 255, 190)

        other.answer = answer
        said: list[str] = []
        flight = MissionFlight(craft, Plan((47.0, 8.0, 488.0), (PLACE,), (), ()), said.append)
        flight.start(ready_within=30.0)
    arm, mode, start = mav.MAV_CMD_COMPONENT_ARM_DISARM, mav.MAV_CMD_DO_SET_MODE, mav.MAV_CMD_MISSION_START
    assert done == [(mode, 4.0), (arm, 1.0), (arm, 0.0), (mode, 3.0), (start, 0.0)]
    assert any(line.startswith("waiting: system 1 refuses to arm: FAILED") for line in said)
