"""Component metadata: found the way the guide says, whole, and about this vehicle.

That the files follow the schemas of the MAVLink project was checked with them; what those ask for is asked for here.
"""

import json
import lzma
import re
import subprocess
import sys
import zlib
from collections.abc import Callable
from typing import Any

import pytest

from sitl.flight.parameter_table import DEFINITIONS
from sitl.mavlink.component_metadata.actuators import actuator_metadata
from sitl.mavlink.component_metadata.parameters import parameter_metadata
from sitl.mavlink.dialect import tiltwing as mav
from tests.sitl.mavlink.ftp_client import FtpClient
from tests.sitl.mavlink.in_memory import Desk
from vehicle_model.aircraft import Aircraft


def crc32(data: bytes) -> int:
    """https://mavlink.io/en/guide/crc.html: from zero, nothing inverted."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


@pytest.fixture
def fetched(desk: Desk) -> Callable[[str], bytes]:
    """A file by its URI, over FTP."""
    client = FtpClient(desk)

    def fetch(uri: str) -> bytes:
        assert uri.startswith("mftp:///")
        return client.get_by_bursts(uri.removeprefix("mftp://").encode())

    return fetch


def requested(desk: Desk, number: int, name: str) -> Any:
    assert desk.command(mav.MAV_CMD_REQUEST_MESSAGE, number).result == mav.MAV_RESULT_ACCEPTED
    return desk.of(name)[-1]


def test_the_general_file_is_where_the_message_says_and_has_the_checksum_it_says(
    desk: Desk, fetched: Callable[[str], bytes]
) -> None:
    message = requested(desk, 397, "COMPONENT_METADATA")
    packed = fetched(message.uri)
    assert crc32(packed) == message.file_crc
    general = json.loads(lzma.decompress(packed))
    assert general["version"] == 1
    assert re.fullmatch(r"\d+\.\d+\.\d+(\.\d+)?", general["firmwareVersion"])
    assert [entry["type"] for entry in general["metadataTypes"]] == [
        mav.COMP_METADATA_TYPE_PARAMETER, mav.COMP_METADATA_TYPE_EVENTS, mav.COMP_METADATA_TYPE_ACTUATORS,
    ]  # fmt: skip


def test_every_file_of_the_general_one_is_there_with_its_checksum_packed_and_plain(
    desk: Desk, fetched: Callable[[str], bytes]
) -> None:
    general = json.loads(lzma.decompress(fetched(requested(desk, 397, "COMPONENT_METADATA").uri)))
    for entry in general["metadataTypes"]:
        packed = fetched(entry["uri"])
        assert crc32(packed) == entry["fileCrc"]
        assert json.loads(fetched(entry["uri"].removesuffix(".xz"))) == json.loads(lzma.decompress(packed))


def test_packed_files_have_the_check_that_small_decoders_know(desk: Desk, fetched: Callable[[str], bytes]) -> None:
    packed = fetched(requested(desk, 397, "COMPONENT_METADATA").uri)
    assert packed[:6] == b"\xfd7zXZ\0"
    assert packed[7] == lzma.CHECK_CRC32


def test_the_older_messages_say_the_same(desk: Desk) -> None:
    new = requested(desk, 397, "COMPONENT_METADATA")
    old = requested(desk, 395, "COMPONENT_INFORMATION")
    assert (old.general_metadata_uri, old.general_metadata_file_crc) == (new.uri, new.file_crc)
    assert (old.peripherals_metadata_uri, old.peripherals_metadata_file_crc) == ("", 0)
    basic = requested(desk, 396, "COMPONENT_INFORMATION_BASIC")
    assert basic.capabilities & mav.MAV_PROTOCOL_CAPABILITY_FTP
    assert (basic.model_name, basic.vendor_name) == (desk.simulation.aircraft.name, "tiltwing-sitl")


# -- parameters --------------------------------------------------------------------------------------------------------


def test_every_parameter_is_described_as_the_flight_has_it() -> None:
    entries = {entry["name"]: entry for entry in parameter_metadata()["parameters"]}
    assert list(entries) == [definition.name for definition in DEFINITIONS]
    for definition in DEFINITIONS:
        entry = entries[definition.name]
        assert re.fullmatch(r"[.\-a-zA-Z0-9_{}]{1,16}", entry["name"])
        assert entry["type"] == {"int": "Int32", "float": "Float"}[definition.kind]
        assert (entry["default"], entry["min"], entry["max"]) == (
            definition.default, definition.minimum, definition.maximum,
        )  # fmt: skip
        assert entry["shortDesc"] == definition.description
        assert entry.get("rebootRequired", False) == definition.reboot_required
        assert entry.get("readOnly", False) == definition.read_only
        choices = {choice["value"]: choice["description"] for choice in entry.get("values", ())}
        assert choices == (definition.values or {})
        bits = {bit["index"]: bit["description"] for bit in entry.get("bitmask", ())}
        assert bits == (definition.bits or {})
        assert entry.get("units", "") == {"1": "norm"}.get(definition.unit, definition.unit)


def test_a_default_can_be_written_with_the_decimals_shown() -> None:
    for entry in parameter_metadata()["parameters"]:
        if entry["type"] == "Float":
            for value in (entry["default"], entry["min"], entry["max"]):
                assert float(f"{value:.{entry['decimalPlaces']}f}") == value
        else:
            assert "decimalPlaces" not in entry


def test_the_command_line_prints_the_metadata_of_the_parameters() -> None:
    printed = subprocess.run(
        [sys.executable, "-W", "error", "-m", "sitl.mavlink.component_metadata"], capture_output=True, check=True
    )
    assert json.loads(printed.stdout) == json.loads(json.dumps(parameter_metadata()))
    assert printed.stderr == b""


# -- actuators ---------------------------------------------------------------------------------------------------------


def test_every_channel_is_an_output_and_every_actuator_a_function(aircraft: Aircraft) -> None:
    metadata = actuator_metadata(aircraft)
    (output,) = metadata["outputs_v1"]
    (group,) = output["subgroups"]
    assert [channel["param-index"] for channel in group["channels"]] == [
        channel.number for channel in aircraft.channels
    ]
    functions = {int(number): function["label"] for number, function in metadata["functions_v1"].items()}
    assert functions == {
        0: "Disabled", 101: "Left motor", 102: "Right motor", 103: "Tail motor",
        201: "Tilt", 202: "Left aileron", 203: "Right aileron", 204: "Elevator",
    }  # fmt: skip


def test_types_cover_all_functions_once_with_the_range_of_their_channels(aircraft: Aircraft) -> None:
    types = actuator_metadata(aircraft)["mixer_v1"]["actuator-types"]
    covered: dict[int, float] = {}
    for name, kind in types.items():
        values = kind["values"]
        assert -1 <= values["min"] <= values["max"] <= 1
        if name != "DEFAULT":
            for number in range(kind["function-min"], kind["function-max"] + 1):
                assert number not in covered
                covered[number] = values["min"]
    motors = [channel.normalised_minimum for channel in aircraft.channels if channel.is_motor]
    servos = [channel.normalised_minimum for channel in aircraft.channels if not channel.is_motor]
    assert covered == dict(enumerate(motors, start=101)) | dict(enumerate(servos, start=201))


def test_motors_stand_where_the_aircraft_has_them(aircraft: Aircraft) -> None:
    (geometry,) = actuator_metadata(aircraft)["mixer_v1"]["config"]
    places: dict[str, list[float]] = {}
    for group in geometry["actuators"]:
        labels = group["item-label-prefix"]
        assert len(labels) == group["count"]
        for parameter in group["per-item-parameters"]:
            for label, value in zip(labels, parameter["value"], strict=True):
                places.setdefault(label, []).append(value)
    positions = aircraft.vehicle[0]["rotors"]["position"]
    for number, label in enumerate(("Left motor", "Right motor", "Tail motor")):
        assert places[label] == pytest.approx(list(positions[number]), abs=1e-3)
