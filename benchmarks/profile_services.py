"""Tries every service of a running vehicle, and sets what comes of it beside what PX4 and ArduPilot were seen to do."""

import hashlib
import json
import lzma
import statistics
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import ftp
from profile_probe import Probe
from transfers import BySocket, mission

from sitl.mavlink.dialect import tiltwing as mav

__all__ = ["Row", "services"]

ITEMS = 6  # of the mission
INTERVALS = (50, 200, 400)  # [Hz]
COUNTED = 3.0  # for so long each [s]
QUESTIONS = 10
NO_SUCH = 31999
NAK = 129
LIST, READ, CREATE_DIRECTORY, REMOVE_DIRECTORY, REMOVE, CRC = 3, 5, 9, 10, 8, 14
SHELL = mav.SERIAL_CONTROL_DEV_SHELL


class Row(NamedTuple):
    """One service: what each of the three does; `answered` says whether ours does all that one of the others does."""

    service: str
    px4: str
    ardupilot: str
    ours: str
    answered: bool


def services(probe: Probe, port: int) -> list[Row]:
    """All of them; `port` is another one of the vehicle, for clients of their own."""
    tried: list[tuple[str, str, str, Callable[[Probe, int], str]]] = [
        ("parameter list", "1137 in 1.1 s", "1531 in 0.7 s", parameter_list),
        ("parameter read, set", "yes; set is echoed", "yes; set is echoed", parameter_set),
        ("unknown parameter", "PARAM_ERROR", "silence", unknown_parameter),
        ("_HASH_CHECK", "yes", "no", hash_check),
        (
            "mission up and down",
            "3 items up in 3 ms; opaque id",
            "6 items up in 34 ms, down in 41 ms; no opaque id",
            plan,
        ),
        ("geofence up and down", "4 items up in 3 ms", "yes", lambda p, _: fetched_plan(p, FENCE, 1)),
        ("rally points up and down", "1 item up in 2 ms", "yes", lambda p, _: fetched_plan(p, RALLY, 2)),
        ("FTP", "list, open, read, CRC32", "list, read, burst, CRC32, create, write, remove, mkdir", files),
        ("FTP: missing file", "-", "NAK 10", missing_file),
        ("component metadata", "parameters, events, actuators", "no", metadata),
        ("log list and LOG_DATA", "yes", "yes", logs),
        ("log stream (LOGGING_START)", "yes", "no", log_stream),
        ("SET_MESSAGE_INTERVAL", "50 Hz asked, 49 got", "50, 200 exact, 400 asked, 200 got", intervals),
        ("modes", "26 AVAILABLE_MODES; CURRENT_MODE", "26 AVAILABLE_MODES; CURRENT_MODE failed", modes),
        ("TIMESYNC", "10 of 10, median 0.08 ms", "answered, median 5.8 ms", clocks),
        ("PING", "answered", "no answer", ping),
        ("REQUEST_EVENT", "EVENT", "no", event),
        ("shell (SERIAL_CONTROL)", "yes", "no", shell),
        ("SET_MODE", "yes", "yes", set_mode),
        ("MANUAL_CONTROL, RC_CHANNELS_OVERRIDE", "yes", "yes", sticks),
        ("TERRAIN_CHECK", "no", "TERRAIN_REPORT", terrain),
        ("unknown command", "UNSUPPORTED", "UNSUPPORTED", lambda p, _: p.command(NO_SUCH).result),
        ("signing", "not tried", "signs all; unsigned commands still taken", signing),
    ]
    rows: list[Row] = []
    for service, px4, ardupilot, attempt in tried:
        try:
            ours, answered = attempt(probe, port), True
        except (TimeoutError, AssertionError, RuntimeError) as error:
            ours, answered = f"no ({error})" if str(error) else "no", False
        rows.append(Row(service, px4, ardupilot, ours, answered))
    return rows


# -- parameters --------------------------------------------------------------------------------------------------------


def parameter_list(_: Probe, port: int) -> str:
    """How many, and how fast."""
    client = BySocket(port)
    begin = time.perf_counter()
    count = client.list_parameters()
    return f"{count} in {time.perf_counter() - begin:.3f} s"


def parameter_set(probe: Probe, _: int) -> str:
    """One read and set to what it is."""
    name = "MPC_XY_CRUISE"
    value = _got(probe.exchange("PARAM_REQUEST_READ", "PARAM_VALUE", {"param_id": name, "param_index": -1}))
    again = {"param_id": name, "param_value": value.param_value, "param_type": value.param_type}
    _got(probe.exchange("PARAM_SET", "PARAM_VALUE", again))
    return "yes; set is echoed"


def unknown_parameter(probe: Probe, _: int) -> str:
    """What is told of it."""
    error = _got(probe.exchange("PARAM_REQUEST_READ", "PARAM_ERROR", {"param_id": "NOPE_XX", "param_index": -1}))
    return f"PARAM_ERROR {error.error}"


def hash_check(probe: Probe, _: int) -> str:
    """The hash of all parameters."""
    fields = {"param_id": "_HASH_CHECK", "param_index": -1}
    _got(probe.exchange("PARAM_REQUEST_READ", "PARAM_VALUE", fields))
    return "yes"


# -- plans -------------------------------------------------------------------------------------------------------------

PLACE = {"x": 473977418, "y": 85455939}
FENCE = [
    {"command": 5001, "frame": mav.MAV_FRAME_GLOBAL, "param1": 4.0, "x": PLACE["x"] + north, "y": PLACE["y"] + east}
    for north, east in ((180_000, 270_000), (180_000, -270_000), (-180_000, -270_000), (-180_000, 270_000))
]
RALLY = [{"command": 5100, "frame": mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, "z": 40.0, **PLACE}]


def plan(probe: Probe, _: int) -> str:
    """A mission."""
    items = mission()
    return fetched_plan(probe, [*items[: ITEMS - 1], items[-1]], 0)


def fetched_plan(probe: Probe, items: list[dict[str, float]], kind: int) -> str:
    """A plan sent, fetched and cleared: how fast, and what was asked with."""
    station = probe.station
    asked: set[str] = set()
    ended: list[Any] = []

    def give(name: str) -> Callable[[Any], None]:
        def send(message: Any) -> None:
            asked.add(name)
            station.send("MISSION_ITEM_INT", seq=message.seq, mission_type=kind, **items[message.seq])

        return send

    for name in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
        station.watch(name, give(name))
    station.watch("MISSION_ACK", ended.append)
    station.send("MISSION_COUNT", count=len(items), mission_type=kind)
    up = station.until(lambda: ended)
    if ended[0].type != mav.MAV_MISSION_ACCEPTED:
        raise RuntimeError(f"MISSION_ACK {ended[0].type}")
    begin = time.perf_counter()
    count = _got(probe.exchange("MISSION_REQUEST_LIST", "MISSION_COUNT", {"mission_type": kind}))
    for number in range(count.count):
        _got(probe.exchange("MISSION_REQUEST_INT", "MISSION_ITEM_INT", {"seq": number, "mission_type": kind}))
    down = time.perf_counter() - begin
    _got(probe.exchange("MISSION_CLEAR_ALL", "MISSION_ACK", {"mission_type": kind}))
    opaque = "; opaque id" if count.opaque_id else ""
    return (
        f"{len(items)} items up in {up * 1e3:.1f} ms ({', '.join(sorted(asked))}), down in {down * 1e3:.1f} ms{opaque}"
    )


# -- files and logs ----------------------------------------------------------------------------------------------------


def files(_: Probe, port: int) -> str:
    """What can be done with files and folders."""
    client = _ftp(port)
    entries = client.ask(LIST, b"/")[1].split(b"\0")
    client.ask(CREATE_DIRECTORY, b"/tried")
    client.upload("/tried/file", b"0123456789" * 100)
    content = client.download("/tried/file")[0]
    assert content == b"0123456789" * 100, "another file came back"
    client.ask(CRC, b"/tried/file")
    client.ask(REMOVE, b"/tried/file")
    client.ask(REMOVE_DIRECTORY, b"/tried")
    places = [entry[1:].decode() for entry in entries if entry[:1] == b"D"]
    return f"list, read, burst, CRC32, create, write, remove, mkdir; folders {', '.join(places)}"


def missing_file(_: Probe, port: int) -> str:
    """The error."""
    client = _ftp(port)
    client.request(ftp.OPEN, b"/not-there")
    while True:
        for answer in client.answers():
            if answer[2] == ftp.OPEN and answer[1] == NAK:
                return f"NAK {answer[5][0]}"


def metadata(probe: Probe, port: int) -> str:
    """What there is a description of, by the general file."""
    came: list[Any] = []
    probe.station.watch("COMPONENT_METADATA", came.append)
    probe.command(mav.MAV_CMD_REQUEST_MESSAGE, 397.0)
    path = _got(came[0] if came else None).uri.decode().removeprefix("mftp://")
    content = _ftp(port).download(f"/{path}")[0]
    general = json.loads(lzma.decompress(content) if path.endswith(".xz") else content)
    kinds = {1: "parameters", 4: "events", 5: "actuators"}
    return ", ".join(kinds.get(entry["type"], f"type {entry['type']}") for entry in general["metadataTypes"])


def logs(probe: Probe, _: int) -> str:
    """The list, and the beginning of one."""
    entry = _got(probe.exchange("LOG_REQUEST_LIST", "LOG_ENTRY", {"start": 0, "end": 0xFFFF}))
    data = probe.exchange("LOG_REQUEST_DATA", "LOG_DATA", {"id": entry.id, "ofs": 0, "count": 90})
    return f"{entry.num_logs} listed, {entry.size} bytes; data {'come' if _got(data).count else 'end at once'}"


def log_stream(probe: Probe, _: int) -> str:
    """Whether anything comes once it is started."""
    came: list[Any] = []
    probe.station.watch("LOGGING_DATA_ACKED", came.append)
    started = probe.command(mav.MAV_CMD_LOGGING_START, 0.0)
    probe.station.until(lambda: came)
    stopped = probe.command(mav.MAV_CMD_LOGGING_STOP)
    return f"start {started.result}, stop {stopped.result}"


def _ftp(port: int) -> ftp.Client:
    client = ftp.Client(BySocket(port, system=253).socket, is_stream=False)
    client.ask(ftp.RESET)
    return client


# -- the rest ----------------------------------------------------------------------------------------------------------


def intervals(probe: Probe, _: int) -> str:
    """Rates asked for and got."""
    got: list[str] = []
    for rate in INTERVALS:
        probe.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, float(mav.MAVLINK_MSG_ID_ATTITUDE), 1e6 / rate)
        got.append(f"{rate} asked, {probe.rates(COUNTED)['']['ATTITUDE']:.0f} got")
    probe.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, float(mav.MAVLINK_MSG_ID_ATTITUDE), 0.0)
    return "; ".join(got)


def modes(probe: Probe, _: int) -> str:
    """How many, and whether the present one is told."""
    came: list[Any] = []
    probe.station.watch("AVAILABLE_MODES", came.append)
    probe.command(mav.MAV_CMD_REQUEST_MESSAGE, 435.0, 0.0)
    probe.station.until(lambda: came and len(came) == came[0].number_modes)
    assert probe.request("CURRENT_MODE").came, "no CURRENT_MODE"
    return f"{len(came)} AVAILABLE_MODES; CURRENT_MODE"


def clocks(probe: Probe, _: int) -> str:
    """Round trips."""
    trips: list[float] = []
    while len(trips) < QUESTIONS:
        begin = time.perf_counter()
        _got(probe.exchange("TIMESYNC", "TIMESYNC", {"tc1": 0, "ts1": time.monotonic_ns()}))
        trips.append((time.perf_counter() - begin) * 1e3)
    return f"{len(trips)} of {QUESTIONS}, median {statistics.median(trips):.2f} ms"


def ping(probe: Probe, _: int) -> str:
    """To everybody."""
    _got(probe.exchange("PING", "PING", {"target_system": 0, "target_component": 0, "seq": 7}))
    return "answered"


def event(probe: Probe, _: int) -> str:
    """The latest."""
    came: list[Any] = []
    probe.station.watch("CURRENT_EVENT_SEQUENCE", came.append)
    probe.command(mav.MAV_CMD_REQUEST_MESSAGE, 411.0)
    probe.station.until(lambda: came)
    number = came[0].sequence
    _got(probe.exchange("REQUEST_EVENT", "EVENT", {"first_sequence": number, "last_sequence": number}))
    return "EVENT"


def shell(probe: Probe, _: int) -> str:
    """A line that it knows."""
    line = b"ver\n"
    flags = mav.SERIAL_CONTROL_FLAG_RESPOND
    _got(
        probe.exchange(
            "SERIAL_CONTROL", "SERIAL_CONTROL", {"device": SHELL, "flags": flags, "count": len(line), "data": line}
        )
    )
    return "yes"


def set_mode(probe: Probe, _: int) -> str:
    """Hold, by the older message."""
    fields = {"base_mode": 1, "custom_mode": 4 << 16 | 3 << 24, "target_system": 1}
    return f"COMMAND_ACK {_got(probe.exchange('SET_MODE', 'COMMAND_ACK', fields)).result}"


def sticks(probe: Probe, _: int) -> str:
    """Both are seen as RC_CHANNELS."""
    probe.station.send("MANUAL_CONTROL", target=1, x=0, y=0, z=500, r=0)
    probe.station.send("RC_CHANNELS_OVERRIDE", chan1_raw=1500, chan2_raw=1500, chan3_raw=1500, chan4_raw=1500)
    assert probe.request("RC_CHANNELS").came, "no RC_CHANNELS"
    return "yes"


def terrain(probe: Probe, _: int) -> str:
    """The ground somewhere."""
    _got(probe.exchange("TERRAIN_CHECK", "TERRAIN_REPORT", {"lat": PLACE["x"], "lon": PLACE["y"]}, patience=2.0))
    return "TERRAIN_REPORT"


def signing(probe: Probe, _: int) -> str:
    """Set up; from then on nobody else is heard. The last thing to try."""
    key = hashlib.sha256(b"compared").digest()
    stamp = int((time.time() - 1420070400) * 1e5)
    probe.station.send("SETUP_SIGNING", secret_key=list(key), initial_timestamp=stamp)
    probe.wait(0.5)
    answer = probe.command(NO_SUCH)
    assert probe.station.signed, "frames without a signature"
    return f"signs all; unsigned commands: {answer.result}"


def _got(message: Any) -> Any:
    if message is None:
        raise TimeoutError
    return message
