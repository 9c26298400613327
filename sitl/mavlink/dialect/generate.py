"""Makes `tiltwing.py` beside this file: our dialect, from the message definitions that pymavlink's wheel ships.

Run by the build (setup.py) and, in a checkout, as `python sitl/mavlink/dialect/generate.py`. It imports nothing of
ours, because a build has not installed us yet.
"""

import contextlib
import io
import py_compile
import tempfile
from collections.abc import Mapping
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

if TYPE_CHECKING:
    _Tree = ET.ElementTree[ET.Element]

__all__ = ["DIALECT", "generate"]

DIALECT = Path(__file__).with_name("tiltwing.xml")
INCLUDED = ("minimal.xml", "standard.xml", "common.xml")

# What the MAVLink project changed in existing definitions after those in the wheel were written. mavgen takes neither a
# second name for a value nor a second definition of a message, so copies of the files are changed.
RENAMED = {
    "MAV_TYPE_VTOL_DUOROTOR": "MAV_TYPE_VTOL_TAILSITTER_DUOROTOR",
    "MAV_TYPE_VTOL_QUADROTOR": "MAV_TYPE_VTOL_TAILSITTER_QUADROTOR",
    "MAV_TYPE_VTOL_RESERVED2": "MAV_TYPE_VTOL_FIXEDROTOR",
    "MAV_TYPE_VTOL_RESERVED3": "MAV_TYPE_VTOL_TAILSITTER",
    "MAV_TYPE_VTOL_RESERVED4": "MAV_TYPE_VTOL_TILTWING",
}
_TARGETS = ("uint8_t target_system", "uint8_t target_component")
EXTENSIONS = {
    "MISSION_CURRENT": ("uint32_t mission_id", "uint32_t fence_id", "uint32_t rally_points_id"),
    "MISSION_COUNT": ("uint32_t opaque_id",),
    "MISSION_ACK": ("uint32_t opaque_id",),
    "SET_ATTITUDE_TARGET": ("float[3] thrust_body",),
    "SERIAL_CONTROL": _TARGETS,
    "TIMESYNC": _TARGETS,
    "WIFI_CONFIG_AP": ("int8_t mode", "int8_t response"),
}

# Messages and enumerations taken from dialects that are not included whole, because they would double the time our
# module takes to import. Of MAV_CMD only the values named here are taken.
BORROWED = {
    "ardupilotmega.xml": (
        *("AHRS", "AHRS2", "AOA_SSA", "AUTOPILOT_VERSION_REQUEST", "EKF_STATUS_REPORT", "ESC_TELEMETRY_1_TO_4"),
        *("ESC_TELEMETRY_5_TO_8", "HWSTATUS", "MAG_CAL_PROGRESS", "MCU_STATUS", "MEMINFO", "RANGEFINDER", "RPM"),
        *("SIMSTATE", "WIND", "EKF_STATUS_FLAGS", "PLANE_MODE", "ACCELCAL_VEHICLE_POS"),
    ),
    "development.xml": (
        *("AVAILABLE_MODES", "AVAILABLE_MODES_MONITOR", "CURRENT_MODE", "GNSS_INTEGRITY"),
        *("GPS_AUTHENTICATION_STATE", "GPS_JAMMING_STATE", "GPS_RAIM_STATE", "GPS_SPOOFING_STATE"),
        *("GPS_SYSTEM_ERROR_FLAGS", "MAV_MODE_PROPERTY"),
    ),
}
BORROWED_COMMANDS = {
    "ardupilotmega.xml": (
        *("MAV_CMD_DO_START_MAG_CAL", "MAV_CMD_DO_ACCEPT_MAG_CAL", "MAV_CMD_DO_CANCEL_MAG_CAL"),
        *("MAV_CMD_DO_SEND_BANNER", "MAV_CMD_ACCELCAL_VEHICLE_POS", "MAV_CMD_BATTERY_RESET"),
    ),
    "development.xml": ("MAV_CMD_DO_SET_GLOBAL_ORIGIN", "MAV_CMD_EXTERNAL_WIND_ESTIMATE"),
}


def generate(output: Path) -> Path:
    """Write the Python module of the dialect to `output` (a .py path), compile it, and return that path.

    Raises RuntimeError if the shipped definitions are not those that the tables above are for or, with mavgen's own
    words, if the dialect does not compile.
    """
    from pymavlink.generator import mavgen

    with as_file(files("pymavlink") / "dialects" / "v20") as shipped, tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        included = {name: ET.parse(shipped / name) for name in INCLUDED}  # noqa: S314  (a wheel we depend on)
        _bring_up_to_date(included)
        for name, tree in included.items():
            _without_descriptions(tree).write(work / name, encoding="utf-8")
        _without_descriptions(_borrowed(shipped)).write(work / "borrowed.xml", encoding="utf-8")
        ours = work / DIALECT.name
        ours.write_bytes(DIALECT.read_bytes())
        made = work / output.name
        said = io.StringIO()
        options = mavgen.Opts(str(made), wire_protocol="2.0", language="Python3", validate=False)
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            accepted = mavgen.mavgen(options, [str(ours)])
        if not accepted or not made.is_file():
            msg = f"{DIALECT}: mavgen refused the dialect:\n{said.getvalue()}"
            raise RuntimeError(msg)
        output.write_bytes(made.read_bytes())
    # Compiled now: reading so much source costs a start 0.2 s wherever Python may not write its cache.
    py_compile.compile(str(output), doraise=True)
    return output


def _bring_up_to_date(included: "Mapping[str, _Tree]") -> None:
    for old, new in RENAMED.items():
        _only(included, ".//entry", old).set("name", new)
    for message, fields in EXTENSIONS.items():
        element = _only(included, "./messages/message", message)
        known = {field.get("name") for field in element.iter("field")}
        if element.find("extensions") is None:
            ET.SubElement(element, "extensions")
        for field in fields:
            kind, name = field.split()
            if name in known:
                msg = f"pymavlink's {message}: expected no field {name}, it has one now"
                raise RuntimeError(msg)
            ET.SubElement(element, "field", type=kind, name=name)


def _borrowed(shipped: Path) -> "_Tree":
    root = ET.Element("mavlink")
    enums = ET.SubElement(root, "enums")
    messages = ET.SubElement(root, "messages")
    commands = ET.SubElement(enums, "enum", name="MAV_CMD")
    for file, names in BORROWED.items():
        tree = {file: ET.parse(shipped / file)}  # noqa: S314  (a wheel we depend on)
        for name in names:
            element = _only(tree, "./*/*", name)
            (messages if element.tag == "message" else enums).append(element)
        commands.extend(_only(tree, ".//entry", name) for name in BORROWED_COMMANDS[file])
    return ET.ElementTree(root)


def _only(trees: "Mapping[str, _Tree]", where: str, name: str) -> ET.Element:
    found = [element for tree in trees.values() for element in tree.iterfind(f"{where}[@name='{name}']")]
    if len(found) != 1:
        msg = f"pymavlink's {', '.join(trees)}: expected {name!r} once, found it {len(found)} times"
        raise RuntimeError(msg)
    return found[0]


def _without_descriptions(tree: "_Tree") -> "_Tree":
    """Their text is two thirds of the generated module and nothing of ours reads it."""
    for tag in ("description", "field", "param"):
        for element in tree.iter(tag):
            element.text = ""
    return tree


if __name__ == "__main__":
    print(generate(DIALECT.with_suffix(".py")))
