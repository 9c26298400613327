"""The whole MAVLink side over real UDP, spoken to with pymavlink."""

import math
import random
import socket
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import pytest
from pymavlink import mavutil

from sitl.mavlink import LinkError, MavlinkFace
from sitl.mavlink.codec import codec, codec_by_id
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.telemetry.streams import DATA_STREAMS, DEFAULT_RATES
from sitl.simulation import Simulation
from tests.sitl.mavlink.in_memory import Desk
from vehicle_model.aircraft import Aircraft

Make = Callable[..., Any]
SET, GET, REQUEST = mav.MAV_CMD_SET_MESSAGE_INTERVAL, mav.MAV_CMD_GET_MESSAGE_INTERVAL, mav.MAV_CMD_REQUEST_MESSAGE
IDS = {message.msgname: message_id for message_id, message in mav.mavlink_map.items()}


@pytest.mark.parametrize("streams", ["normal", "onboard"])
def test_default_streams_have_px4s_rates(ground: Make, streams: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sitl.mavlink.links.ONBOARD_PORTS", range(1 << 16) if streams == "onboard" else ())
    made = ground()
    client = made.heard(made.client())
    made.fly(10.0)
    made.until(lambda: len(client.of("ATTITUDE")) >= 10 * DEFAULT_RATES[streams]["ATTITUDE"])
    told_on_change = {"MISSION_CURRENT", "CURRENT_MODE", "HOME_POSITION"}
    only_sometimes = {"ORBIT_EXECUTION_STATUS"}
    rates = {n: r for n, r in DEFAULT_RATES[streams].items() if n not in told_on_change | only_sometimes}
    # Both ends of the ten seconds are ticks, so each stream has one message more than its rate says.
    assert {name: len(client.of(name)) for name in rates} == {
        name: math.floor(10 * rate) + 1 for name, rate in rates.items()
    }
    assert len(client.of("HEARTBEAT")) == 11


@pytest.mark.parametrize("rate", [1, 3, 30, 50, 160, 250, 400])
def test_an_interval_is_exact_in_simulated_time(ground: Make, rate: int) -> None:
    made = ground()
    client = made.heard(made.client())
    made.face.publish(made.at(0.0), made.wall)
    assert made.acknowledged(client, SET, IDS["HIL_GPS"], round(1e6 / rate)).result == mav.MAV_RESULT_ACCEPTED
    client.received.clear()
    made.fly(4.0)
    made.until(lambda: client.of("HIL_GPS") and client.of("HIL_GPS")[-1].time_usec >= 4e6 - 1e6 / rate)
    times = [message.time_usec for message in client.of("HIL_GPS")]
    assert abs(len(times) - 1 - 4 * rate) <= 1
    if 400 % rate == 0:
        assert {late - early for early, late in pairwise(times)} == {round(1e6 / rate)}
    else:  # a rate that is no divisor of the ticks: the right number of messages, each at the tick after its time
        assert {late - early for early, late in pairwise(times)} <= {
            2500 * math.floor(400 / rate), 2500 * math.ceil(400 / rate),
        }  # fmt: skip


def test_a_stream_is_stopped_and_given_its_default_again(ground: Make) -> None:
    made = ground()
    client = made.heard(made.client())

    def interval() -> int:
        made.acknowledged(client, GET, IDS["ATTITUDE"])
        made.until(lambda: client.of("MESSAGE_INTERVAL"))
        message = client.received.pop(client.received.index(client.of("MESSAGE_INTERVAL")[0]))
        assert message.message_id == IDS["ATTITUDE"]
        return message.interval_us

    assert interval() == 20000
    made.acknowledged(client, SET, IDS["ATTITUDE"], -1)
    assert interval() == -1
    made.fly(1.0)
    assert client.of("ATTITUDE") == []
    made.acknowledged(client, SET, IDS["ATTITUDE"], 0)
    assert interval() == 20000
    made.acknowledged(client, SET, IDS["ATTITUDE"], 10)
    assert interval() == 2500  # 400 Hz is the most there is


def test_the_interval_of_a_message_we_do_not_send_is_not_available(ground: Make) -> None:
    made = ground()
    client = made.heard(made.client())
    assert (
        made.acknowledged(client, REQUEST, IDS["MESSAGE_INTERVAL"], IDS["CAMERA_INFORMATION"]).result
        == mav.MAV_RESULT_ACCEPTED
    )
    made.until(lambda: client.of("MESSAGE_INTERVAL"))
    assert client.of("MESSAGE_INTERVAL")[0].interval_us == 0


def test_nobody_can_change_the_heartbeat(ground: Make) -> None:
    made = ground()
    client = made.heard(made.client())
    assert made.acknowledged(client, SET, IDS["HEARTBEAT"], 2500).result == mav.MAV_RESULT_DENIED
    made.acknowledged(client, GET, IDS["HEARTBEAT"])
    made.until(lambda: client.of("MESSAGE_INTERVAL"))
    assert client.of("MESSAGE_INTERVAL")[0].interval_us == 1_000_000


def test_every_message_that_is_streamed_or_offered_comes_on_request(desk: Desk) -> None:
    desk.simulation.reset("trim:20")  # in the air, for some are about flights
    desk.advance(1.0)
    silent = []
    of_an_index = {"PARAM_VALUE"}
    for name in sorted({codec_by_id(number).name for number in desk.face.offered} - {"HEARTBEAT"} - of_an_index):
        desk.received.clear()
        answer = desk.command(REQUEST, IDS[name])
        assert answer.result in (mav.MAV_RESULT_ACCEPTED, mav.MAV_RESULT_TEMPORARILY_REJECTED), name
        if not desk.of(name):
            silent.append(name)
            assert answer.result == mav.MAV_RESULT_TEMPORARILY_REJECTED, name
    assert set(silent) <= {
        "ORBIT_EXECUTION_STATUS",  # there is no orbit to tell of
        "OPEN_DRONE_ID_OPERATOR_ID", "OPEN_DRONE_ID_SELF_ID",  # nobody has given them
    }, silent  # fmt: skip


def test_every_default_stream_has_somebody_who_makes_it(desk: Desk) -> None:
    named = {name for rates in DEFAULT_RATES.values() for name in rates} | {n for g in DATA_STREAMS.values() for n in g}
    assert {name for name in named if IDS[name] not in desk.face.streamed} == set()


def test_versions_come_on_request_by_new_and_old_commands(ground: Make) -> None:
    made = ground()
    client = made.heard(made.client())
    made.acknowledged(client, REQUEST, IDS["AUTOPILOT_VERSION"])
    made.acknowledged(client, mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1)
    made.acknowledged(client, REQUEST, IDS["PROTOCOL_VERSION"])
    made.acknowledged(client, mav.MAV_CMD_REQUEST_PROTOCOL_VERSION, 1)
    made.until(lambda: len(client.of("AUTOPILOT_VERSION")) == len(client.of("PROTOCOL_VERSION")) == 2)
    version = client.of("AUTOPILOT_VERSION")[0]
    assert version.capabilities & mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    assert version.uid != 0
    assert any(version.flight_custom_version)
    protocol = client.of("PROTOCOL_VERSION")[0]
    assert (protocol.version, protocol.min_version, protocol.max_version) == (200, 100, 200)


def test_answers_go_to_the_asker_alone(ground: Make) -> None:
    made = ground()
    asker, other = made.heard(made.client(system=245, component=190)), made.heard(made.client(system=250))
    ack = made.acknowledged(asker, 9999)
    assert (ack.target_system, ack.target_component) == (245, 190)
    made.face.statustext(6, "to everybody")
    made.until(lambda: other.of("STATUSTEXT"))
    assert other.of("COMMAND_ACK") == []


def test_ping_is_answered_and_answers_are_not(ground: Make) -> None:
    made = ground()
    client = made.heard(made.client())
    client.send(mav.MAVLink_ping_message(1, 2, 1, 1))
    client.send(mav.MAVLink_ping_message(77, 88, 0, 0))
    made.until(lambda: client.of("PING"))
    [answer] = client.of("PING")
    assert (answer.time_usec, answer.seq, answer.target_system, answer.target_component) == (77, 88, 255, 190)


def test_timesync_is_answered_in_simulated_nanoseconds(ground: Make) -> None:
    made = ground()
    client = made.heard(made.client())
    made.face.publish(made.at(12.3475), made.wall)
    client.send(mav.MAVLink_timesync_message(123, 456, 1, 1))  # an answer to somebody
    client.send(mav.MAVLink_timesync_message(0, 987654321, 0, 0))
    made.until(lambda: client.of("TIMESYNC"))
    [answer] = client.of("TIMESYNC")
    assert (answer.tc1, answer.ts1) == (12_347_500_000, 987654321)
    assert (answer.target_system, answer.target_component) == (255, 190)


def test_long_texts_arrive_in_numbered_pieces(ground: Make) -> None:
    made = ground()
    client = made.heard(made.client())
    text = "".join(chr(ord("a") + i % 26) for i in range(100))
    made.face.statustext(4, text)
    made.until(lambda: len(client.of("STATUSTEXT")) == 3)
    pieces = client.of("STATUSTEXT")
    assert "".join(piece.text for piece in pieces) == text
    assert [piece.chunk_seq for piece in pieces] == [0, 1, 2]
    assert len({piece.id for piece in pieces}) == 1
    assert pieces[0].id != 0
    assert {piece.severity for piece in pieces} == {4}


def test_above_real_time_defaults_keep_their_rate_per_wall_second_and_requests_are_exact(ground: Make) -> None:
    made = ground(speed=math.inf)
    client = made.heard(made.client())
    made.acknowledged(client, SET, IDS["HIL_GPS"], 100_000)
    made.fly(10.0, speed=10.0)  # one wall second
    client.received.clear()
    begun = made.face.next_due()
    made.fly(20.0, start=begun, speed=10.0)  # two
    made.until(lambda: len(client.of("HIL_GPS")) >= 200)
    assert len(client.of("HIL_GPS")) == pytest.approx(200, abs=1)
    assert len(client.of("ATTITUDE")) == pytest.approx(100, rel=0.1)
    assert len(client.of("HEARTBEAT")) == pytest.approx(2, abs=1)


def test_a_host_of_changing_speed_gets_the_default_rates_per_wall_second_too(ground: Make) -> None:
    made = ground(speed=math.inf)
    client = made.heard(made.client())
    made.fly(10.0, speed=10.0)
    client.received.clear()
    simulated = 10.0
    for speed in (7.0, 13.0) * 20:  # each for a tenth of a wall second
        made.fly(0.1 * speed, start=simulated, speed=speed)
        simulated += 0.1 * speed
    made.until(lambda: len(client.of("ATTITUDE")) >= 180)
    assert len(client.of("ATTITUDE")) == pytest.approx(200, rel=0.1)


def test_the_heartbeat_goes_on_while_simulated_time_stands_still(ground: Make) -> None:
    made = ground()
    client = made.heard(made.client())
    for _ in range(50):
        made.face.publish(made.at(3.0), made.wall)
        made.wall += 0.1
    made.until(lambda: len(client.of("HEARTBEAT")) >= 5)
    assert len(client.of("HEARTBEAT")) == 5
    assert len(client.of("ATTITUDE")) == 1


@pytest.fixture
def mavutil_connection(ground: Make) -> Iterator[tuple[Any, Any]]:
    made = ground()
    connection = mavutil.mavlink_connection(f"udpout:127.0.0.1:{made.port}", source_system=255, dialect="common")
    yield made, connection
    connection.close()


def test_mavutil_sees_a_tilt_wing_and_reads_several_messages_from_one_datagram(
    mavutil_connection: tuple[Any, Any],
) -> None:
    made, connection = mavutil_connection
    connection.mav.heartbeat_send(6, 8, 0, 0, 0)
    made.until(lambda: made.rx)
    made.face.publish(made.at(1.0), made.wall)
    kinds: dict[str, Any] = {}
    end = time.monotonic() + 10.0
    while not {"HEARTBEAT", "SYS_STATUS", "ATTITUDE", "NAMED_VALUE_FLOAT", "RC_CHANNELS", "WIND_COV"} <= kinds.keys():
        assert time.monotonic() < end
        message = connection.recv_match(blocking=False)
        if message is not None:
            kinds[message.get_type()] = message
    assert (kinds["HEARTBEAT"].type, kinds["HEARTBEAT"].autopilot) == (24, 12)
    assert (connection.target_system, connection.mav.total_receive_errors) == (1, 0)


def test_nothing_that_arrives_disturbs_the_vehicle(ground: Make) -> None:
    """Random bytes, cut frames and well-formed random messages of every kind; afterwards it still answers."""
    made = ground(system_id=3)
    client = made.heard(made.client())
    made.face.publish(made.at(1.0), made.wall)
    numbers = random.Random(1389)
    packers = [codec(message.msgname) for message in mav.mavlink_map.values()]
    for number in range(20_000):
        kind = number % 4
        packer = numbers.choice(packers)
        payload = numbers.randbytes(packer.size)
        frame = packer.frame(payload, number & 0xFF, numbers.randrange(256), numbers.randrange(256))
        data = (
            frame,
            frame[: numbers.randrange(1, len(frame))],
            numbers.randbytes(numbers.randrange(1, 300)),
            numbers.randbytes(numbers.randrange(60_000, 65_000)) if number % 1000 == 3 else frame + frame[:-1] + frame,
        )[kind]
        client.socket.send(data)
        if number % 50 == 0:
            made.face.receive(made.wall)
            made.wall += 0.01
            while True:
                try:
                    client.socket.recv(65536)
                except BlockingIOError:
                    break
    statistics = made.face.statistics()[made.link]
    assert statistics["rx"] > 5000
    assert statistics["malformed"] > 5000
    controls = made.face.servo_input.controls
    assert all(math.isfinite(value) for value in controls)
    made.face.publish(made.at(2.0), made.wall)
    before = len(client.of("COMMAND_ACK"))
    client.mav = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    client.mav.robust_parsing = True
    client.command(REQUEST, IDS["PROTOCOL_VERSION"], target=(3, 1))
    made.until(lambda: len([ack for ack in client.of("COMMAND_ACK")[before:] if ack.command == REQUEST]) >= 1)


def test_a_bad_link_leaves_no_other_open(aircraft: Aircraft) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with pytest.raises(LinkError, match="udpsideways"):
        MavlinkFace([f"udpin:{port}", "udpsideways:1"], Simulation(aircraft=aircraft))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(("127.0.0.1", port))
