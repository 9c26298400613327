"""`param` with a real vehicle, in both encodings, and over a wire that loses datagrams."""

import re
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from gcs_scripts.param import main
from gcs_scripts.parameter_file import read_file

Vehicle = Callable[..., AbstractContextManager[str]]
Wire = Callable[[int, float], AbstractContextManager[tuple[int, list[int]]]]
Capture = pytest.CaptureFixture[str]
IDENTITIES = ("px4", "ardupilot", "generic")


def defaults() -> dict[str, tuple[float, bool]]:
    """Default and whether it is an integer, of every parameter, from the vehicle's own table in the documentation."""
    page = (Path(__file__).parents[2] / "docs" / "parameters.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| .*? \| (-?[\d.e-]+) \| ", page, re.MULTILINE)
    return {name: (float(value), float(value).is_integer()) for name, value in rows}


@pytest.mark.parametrize("identity", IDENTITIES)
def test_the_list_is_every_parameter_with_its_default(vehicle: Vehicle, capsys: Capture, identity: str) -> None:
    with vehicle("--identity", identity) as link:
        assert main(["list", "--connect", link]) == 0
    told = {name: float(value) for name, value, _ in (line.split() for line in capsys.readouterr().out.splitlines())}
    for name, (value, _) in defaults().items():
        assert told[name] == pytest.approx(value, rel=1e-6), name


@pytest.mark.parametrize("identity", IDENTITIES)
def test_floats_and_integers_are_set_saved_compared_and_loaded(
    vehicle: Vehicle, capsys: Capture, tmp_path: Path, identity: str
) -> None:
    before, after = tmp_path / "before.params", tmp_path / "after.parm"
    with vehicle("--identity", identity) as link:
        there = ["--connect", link]
        assert main([*there, "save", str(before)]) == 0
        assert main(["diff", str(before), *there]) == 0
        assert main(["set", "MIS_TAKEOFF_ALT=21.5", "COM_RCL_EXCEPT=3", *there]) == 0
        assert main(["set", "rtl_land_delay", "-1", *there]) == 0
        capsys.readouterr()
        assert main(["get", "COM_RCL_EXCEPT", *there]) == 0
        assert capsys.readouterr().out == "3\n"
        assert main(["diff", str(before), *there]) == 1
        rows = [line.split() for line in capsys.readouterr().out.splitlines()]
        assert [(name, float(a), float(b)) for name, a, b in rows] == [
            ("COM_RCL_EXCEPT", 0, 3), ("MIS_TAKEOFF_ALT", 15, 21.5), ("RTL_LAND_DELAY", 0, -1),
        ]  # fmt: skip
        assert main(["save", str(after), *there]) == 0
        assert main(["load", str(before), *there]) == 0
        assert main(["diff", str(before), *there]) == 0
        assert main(["load", str(after), *there]) == 0
        assert main(["diff", str(after), "--all", *there]) == 0
    assert {v.name: v.value for v in read_file(after)}["RTL_LAND_DELAY"] == -1


def test_refusals_name_the_reason_and_leave_the_rest_to_be_loaded(
    vehicle: Vehicle, capsys: Capture, tmp_path: Path
) -> None:
    file = tmp_path / "some.parm"
    file.write_text("MIS_TAKEOFF_ALT 1e6\nNO_SUCH_THING 1\nRTL_RETURN_ALT 55\n")
    with vehicle() as link:
        there = ["--connect", link]
        assert main(["set", "MIS_TAKEOFF_ALT=-5", *there]) == 3
        assert re.search(r"refuses MIS_TAKEOFF_ALT = -5: .*expected 1 to 120", capsys.readouterr().err)
        assert main(["set", "COM_RCL_EXCEPT=1.5", *there]) == 3
        assert "expected an integer" in capsys.readouterr().err
        assert main(["get", "NO_SUCH_THING", *there, "--timeout", "1"]) in (3, 5)
        assert "does not tell NO_SUCH_THING" in capsys.readouterr().err
        assert main(["load", str(file), *there]) == 3
        said = capsys.readouterr()
        assert "NO_SUCH_THING: the vehicle has no such parameter" in said.err
        assert "MIS_TAKEOFF_ALT" in said.err
        assert "1 set, 2 not" in said.out
        assert main(["get", "RTL_RETURN_ALT", *there]) == 0
        assert capsys.readouterr().out == "55.0\n"


def test_a_third_of_all_datagrams_may_be_lost(
    vehicle: Vehicle, lossy_wire: Wire, free_port: Callable[[], int], capsys: Capture, tmp_path: Path
) -> None:
    port, file = free_port(), tmp_path / "all.params"
    with lossy_wire(port, 0.33) as (wire, dropped), vehicle(link=f"udpin:127.0.0.1:{port}"):
        there = ["--connect", f"udpout:127.0.0.1:{wire}"]
        assert main(["save", str(file), *there]) == 0, capsys.readouterr().err
        assert main(["set", "MIS_TAKEOFF_ALT=21", "COM_RCL_EXCEPT=5", *there]) == 0, capsys.readouterr().err
        assert main(["diff", str(file), *there]) == 1
    assert dropped[0] > 20
    assert {v.name for v in read_file(file)} >= defaults().keys()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["set", "MIS_TAKEOFF_ALT"], "expected NAME=VALUE"),
        (["set", "A=b"], "expected NAME=VALUE"),
        (["load", "/nowhere/x.params"], "cannot be read: No such file"),
        (["list", "--timeout", "0"], "--timeout"),
        (["list", "--connect", "here"], "--connect: expected"),
        ([], "Missing command"),
    ],
)
def test_a_wrong_command_line_is_one_line_before_any_vehicle(
    capsys: Capture, arguments: list[str], complaint: str
) -> None:
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert complaint in said
    assert said.count("\n") == 1


def test_no_vehicle_is_one_line_after_the_timeout(free_port: Callable[[], int], capsys: Capture) -> None:
    assert main(["list", "--connect", f"udpin:127.0.0.1:{free_port()}", "--timeout", "0.3"]) == 4
    assert "no vehicle on udpin" in capsys.readouterr().err
