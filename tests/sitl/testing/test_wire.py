"""What the wire does to frames, on an invented clock and without sockets; the frames are pymavlink's own."""

from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import common as v1
from pymavlink.dialects.v20 import all as mav

from sitl.testing.faults import split_frames
from sitl.testing.wire import Wire

CLIENT = (245, 190)


def packer(system: int = 1, component: int = 1) -> Any:
    return mav.MAVLink(None, srcSystem=system, srcComponent=component)


def pings(numbers: Iterable[int]) -> list[bytes]:
    """Frames that can be told apart by `seq`."""
    writer = packer()
    return [bytes(mav.MAVLink_ping_message(0, number, 0, 0).pack(writer)) for number in numbers]


def heartbeat() -> bytes:
    return bytes(mav.MAVLink_heartbeat_message(24, 12, 1, 0, 4, 3).pack(packer()))


def command(number: int, *, system: int = 1, component: int = 1, is_int: bool = False, confirmation: int = 0) -> bytes:
    message: Any
    if is_int:
        message = mav.MAVLink_command_int_message(system, component, 6, number, 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0)
    else:
        message = mav.MAVLink_command_long_message(system, component, number, confirmation, *[0.0] * 7)
    return bytes(message.pack(packer(*CLIENT)))


def decoded(data: bytes) -> list[Any]:
    return packer().parse_buffer(bytearray(data)) or []


class Ends:
    """Both ends of a wire: gives it frames at invented times and collects what arrives, as (time, message)."""

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        self.now = 0.0
        self.vehicle: list[tuple[float, Any]] = []
        self.client: list[tuple[float, Any]] = []

    def send(self, *datagrams: bytes, to_vehicle: bool = False) -> None:
        for data in datagrams:
            self._take(self.wire.carry(data, self.now, to_vehicle=to_vehicle))

    def wait(self, seconds: float) -> None:
        """Let time pass, from one event to the next as the relay does."""
        end = self.now + seconds
        while (due := self.wire.next_due()) is not None and due <= end:
            self.now = due
            self._take(self.wire.due(self.now))
        self.now = end

    def numbers(self) -> list[int]:
        return [message.seq for _, message in self.client if message.get_type() == "PING"]

    def _take(self, arrived: list[tuple[bool, bytes]]) -> None:
        for to_vehicle, data in arrived:
            assert len(data) <= 1400
            end = self.vehicle if to_vehicle else self.client
            end += [(self.now, message) for message in decoded(data)]


@pytest.fixture
def ends() -> Ends:
    return Ends(Wire(system=1, seed=3))


@given(st.lists(st.sampled_from(["v1", "v2", "signed"]), max_size=8), st.binary(max_size=30))
def test_a_datagram_is_split_where_pymavlink_put_the_frames_together(kinds: list[str], rest: bytes) -> None:
    frames: list[bytes] = []
    for kind in kinds:
        writer: Any = v1.MAVLink(None) if kind == "v1" else packer()
        if kind == "signed":
            writer.signing.secret_key = bytes(32)
            writer.signing.sign_outgoing = True
        frames.append(bytes(writer.ping_encode(1, 2, 0, 0).pack(writer)))
    rest = rest.lstrip(b"\xfd\xfe")
    pieces = list(split_frames(b"".join([*frames, rest])))
    assert [piece for _, piece in pieces[: len(frames)]] == frames
    assert all(message == mav.MAVLINK_MSG_ID_PING for message, _ in pieces[: len(frames)])
    assert b"".join(piece for _, piece in pieces[len(frames) :]) == rest


@given(st.binary(max_size=600))
def test_whatever_bytes_come_none_is_lost_in_splitting_them(data: bytes) -> None:
    assert b"".join(piece for _, piece in split_frames(data)) == data


@given(st.binary(max_size=600))
def test_a_wire_without_faults_passes_any_bytes_on_as_they_are(data: bytes) -> None:
    wire = Wire()
    assert wire.carry(data, 0.0, to_vehicle=True) == [(True, data)]
    assert wire.carry(data, 0.0, to_vehicle=False) == [(False, data)]


@given(st.binary(max_size=600))
def test_no_bytes_break_a_wire_with_every_fault(data: bytes) -> None:
    wire = Wire()
    wire.drop(0.1)
    wire.deny(share=0.5)
    wire.duplicate(0.5)
    wire.reorder(0.5)
    wire.delay(0.1, 0.1, share=0.5)
    for to_vehicle in (True, False):
        wire.carry(data, 0.0, to_vehicle=to_vehicle)
    wire.due(10.0)
    assert wire.next_due() is None
    wire.messages()


def test_a_share_is_lost_and_the_rest_keeps_its_order(ends: Ends) -> None:
    lost = ends.wire.drop(0.3)
    ends.send(*pings(range(2000)))
    assert ends.numbers() == sorted(set(ends.numbers()))
    assert lost.hits == 2000 - len(ends.numbers())
    assert lost.hits == pytest.approx(600, abs=4 * (2000 * 0.3 * 0.7) ** 0.5)  # four standard deviations


def test_frames_of_one_datagram_are_lost_one_by_one(ends: Ends) -> None:
    ends.wire.drop(0.5)
    ends.send(b"".join(pings(range(30))))
    assert 0 < len(ends.numbers()) < 30


def fates(seed: int, between: int) -> list[int]:
    """Which of 100 pings arrive at 50 % loss, with other traffic in between."""
    ends = Ends(Wire(seed=seed))
    ends.wire.drop(0.5)
    for frame in pings(range(100)):
        ends.send(frame, *[heartbeat()] * between)
        ends.send(*[command(400)] * between, to_vehicle=True)
    return ends.numbers()


def test_the_same_seed_gives_a_message_the_same_fate_whatever_else_is_sent() -> None:
    assert fates(1, 0) == fates(1, 3)
    assert fates(1, 0) != fates(2, 0)


def test_two_faults_of_the_same_kind_choose_independently(ends: Ends) -> None:
    ends.wire.drop(0.5)
    ends.wire.drop(0.5)
    ends.send(*pings(range(2000)))
    assert len(ends.numbers()) == pytest.approx(500, abs=80)


def test_a_count_ends_a_fault_and_names_choose_messages(ends: Ends) -> None:
    lost = ends.wire.drop(messages="PING", count=2)
    ends.send(heartbeat(), *pings(range(4)))
    assert ends.numbers() == [2, 3]
    assert [message.get_type() for _, message in ends.client] == ["HEARTBEAT", "PING", "PING"]
    assert lost.hits == 2


def test_a_direction_leaves_the_other_alone(ends: Ends) -> None:
    ends.wire.drop(direction="to_vehicle")
    ends.send(heartbeat())
    ends.send(command(400), to_vehicle=True)
    assert (len(ends.client), len(ends.vehicle)) == (1, 0)


def test_a_duplicate_follows_its_original(ends: Ends) -> None:
    ends.wire.duplicate(messages=["PING"])
    ends.send(b"".join([*pings(range(40)), heartbeat()]))  # twice that does not fit a datagram
    assert ends.numbers() == [number for number in range(40) for _ in range(2)]
    assert [message.get_type() for _, message in ends.client].count("HEARTBEAT") == 1


def test_a_frame_is_overtaken_by_as_many_as_asked(ends: Ends) -> None:
    ends.wire.reorder(behind=2, count=1)
    ends.send(*pings(range(5)))
    assert ends.numbers() == [1, 2, 0, 3, 4]


def test_a_frame_that_nobody_overtakes_arrives_all_the_same(ends: Ends) -> None:
    ends.wire.reorder(behind=2)
    ends.send(*pings(range(1)))
    assert ends.numbers() == []
    ends.wait(0.5)
    assert [round(moment, 3) for moment, _ in ends.client] == [0.2]
    assert ends.wire.next_due() is None


def test_reordering_loses_and_adds_nothing(ends: Ends) -> None:
    ends.wire.reorder(0.5, behind=3)
    for frame in pings(range(500)):
        ends.send(frame)
        ends.now += 1e-3
    ends.wait(1.0)
    assert sorted(ends.numbers()) == list(range(500))
    assert ends.numbers() != list(range(500))


def test_delayed_frames_take_their_time_and_keep_their_order(ends: Ends) -> None:
    ends.wire.delay(0.5)
    for frame in pings(range(10)):
        ends.send(frame)
        ends.wait(0.01)
    ends.wait(2.0)
    assert ends.numbers() == list(range(10))
    assert [moment for moment, _ in ends.client] == pytest.approx([0.5 + 0.01 * number for number in range(10)])


def test_jitter_adds_up_to_as_much_as_asked(ends: Ends) -> None:
    ends.wire.delay(0.1, 0.2)
    ends.send(*pings(range(200)))
    ends.wait(1.0)
    moments = [moment for moment, _ in ends.client]
    assert 0.1 <= min(moments) < 0.12
    assert 0.28 < max(moments) <= 0.3
    assert ends.numbers() != sorted(ends.numbers())


def test_silence_takes_what_is_under_way_too_and_restore_lets_the_next_through(ends: Ends) -> None:
    ends.wire.delay(0.1)
    ends.send(*pings(range(3)))
    ends.wire.silence()
    ends.send(*pings(range(3, 6)))
    ends.wait(1.0)
    ends.wire.restore()
    ends.send(*pings(range(6, 9)))
    assert ends.numbers() == [6, 7, 8]


def test_a_fault_ends_with_its_block_and_leaves_the_others(ends: Ends) -> None:
    ends.wire.drop(messages="HEARTBEAT")
    with ends.wire.silence("to_client"):
        ends.send(*pings([0]))
    ends.send(heartbeat(), *pings([1]))
    assert [message.get_type() for _, message in ends.client] == ["PING"]
    assert ends.numbers() == [1]


@pytest.mark.parametrize("is_int", [False, True])
@pytest.mark.parametrize("named", ["MAV_CMD_COMPONENT_ARM_DISARM", "component_arm_disarm", 400])
def test_a_denied_command_is_answered_to_its_sender_and_does_not_arrive(
    ends: Ends, named: str | int, is_int: bool
) -> None:
    denied = ends.wire.deny(named, "TEMPORARILY_REJECTED")
    ends.send(command(400, is_int=is_int), command(22, is_int=is_int), to_vehicle=True)
    assert [message.command for _, message in ends.vehicle] == [22]
    ((_, answer),) = ends.client
    assert answer.get_type() == "COMMAND_ACK"
    assert (answer.get_srcSystem(), answer.get_srcComponent()) == (1, 1)
    assert (answer.command, answer.result) == (400, mav.MAV_RESULT_TEMPORARILY_REJECTED)
    assert (answer.target_system, answer.target_component) == CLIENT
    assert denied.hits == 1


def test_all_commands_are_denied_if_none_is_named(ends: Ends) -> None:
    ends.wire.deny()
    ends.send(*map(command, (16, 400, 31010)), to_vehicle=True)
    assert ends.vehicle == []
    answers = [(message.command, message.result) for _, message in ends.client]
    assert answers == [(number, mav.MAV_RESULT_DENIED) for number in (16, 400, 31010)]


def test_commands_for_others_are_none_of_the_wires_business(ends: Ends) -> None:
    ends.wire.deny()
    ends.send(command(400, system=2), command(400, component=154), to_vehicle=True)
    assert len(ends.vehicle) == 2
    assert ends.client == []


def test_a_command_that_is_lost_is_not_denied_and_an_answer_can_be_lost_too(ends: Ends) -> None:
    ends.wire.deny()
    ends.wire.drop(messages="COMMAND_LONG", count=1)
    ends.wire.drop(messages="COMMAND_ACK", count=1)
    ends.send(*[command(400)] * 3, to_vehicle=True)
    assert len(ends.client) == 1


def test_a_command_in_mavlink_1_is_denied_as_well(ends: Ends) -> None:
    ends.wire.deny()
    writer: Any = v1.MAVLink(None, *CLIENT)
    ends.send(bytes(writer.command_long_encode(1, 1, 400, 0, *[0.0] * 7).pack(writer)), to_vehicle=True)
    assert ends.client[0][1].target_system == CLIENT[0]


def test_the_wire_remembers_what_was_sent_also_what_it_lost(ends: Ends) -> None:
    ends.wire.drop()
    ends.send(*(command(400, confirmation=number) for number in range(3)), heartbeat(), to_vehicle=True)
    ends.send(b"".join(pings(range(5))))
    assert [message.confirmation for message in ends.wire.messages("COMMAND_LONG")] == [0, 1, 2]
    assert [message.get_type() for message in ends.wire.messages()] == ["COMMAND_LONG"] * 3 + ["HEARTBEAT"]
    assert [message.seq for message in ends.wire.messages("PING", direction="to_client")] == list(range(5))
    moments = [message._timestamp for message in ends.wire.messages()]
    assert moments == sorted(moments)


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda wire: wire.drop(1.5), "share: expected 0 to 1, got 1.5"),
        (lambda wire: wire.drop(float("nan")), "share"),
        (lambda wire: wire.drop(messages="HEARTBEET"), "message: expected a name that pymavlink knows"),
        (lambda wire: wire.drop(direction="up"), "direction: expected one of both, to_vehicle, to_client, got 'up'"),
        (lambda wire: wire.drop(count=0), "count: expected at least 1, got 0"),
        (lambda wire: wire.reorder(behind=0), "behind: expected at least 1"),
        (lambda wire: wire.delay(-1.0), "seconds: expected wall seconds"),
        (lambda wire: wire.delay(0.1, float("inf")), "jitter: expected wall seconds"),
        (lambda wire: wire.deny("ARM"), "command: expected a name that pymavlink knows, or a number, got 'ARM'"),
        (lambda wire: wire.deny(result="NO"), "result: expected a name"),
        (lambda wire: wire.messages(direction="both"), "direction: expected to_vehicle or to_client"),
    ],
)
def test_what_no_wire_can_do_is_refused_by_name(call: Any, expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        call(Wire())
