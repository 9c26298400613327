"""The plugin as pytest runs it: in a pytest of its own, with real vehicles."""

import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "docs" / "examples" / "test_my_client.py"
DEADLINE = 30.0  # [s]
NO_CACHE = ("-p", "no:cacheprovider")
HOME = str(Path.home())


@pytest.fixture(autouse=True)
def home(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pytester gives its tests an empty home, where the vehicle would have to be compiled again."""
    del pytester
    monkeypatch.setenv("HOME", HOME)


@pytest.fixture
def run(pytester: pytest.Pytester) -> Callable[..., pytest.RunResult]:
    """Runs pytest in another process, in an empty folder; warnings are errors there, too."""
    return lambda *arguments: pytester.runpytest_subprocess("-W", "error", *NO_CACHE, *arguments, timeout=120)


def is_gone(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return True
    return state == "Z"


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end
        select.select([], [], [], 0.01)


def test_options_of_a_test_go_before_those_of_its_class_the_command_line_and_the_file(
    pytester: pytest.Pytester, run: Callable[..., pytest.RunResult]
) -> None:
    pytester.makeini("[pytest]\ntiltwing_speed = 3\ntiltwing_seed = 11\ntiltwing_identity =\n")
    pytester.makepyfile("""
        import pytest

        @pytest.mark.tiltwing_sitl(at="trim:20", system_id=4)
        class TestCruise:
            @pytest.mark.tiltwing_sitl(system_id=5, wind=(-2, 1))
            def test_one(self, tiltwing_sitl_factory):
                vehicle = tiltwing_sitl_factory(wind=(0, 0, 1))
                options = vehicle.options
                assert (options.at, options.system_id, options.wind) == ("trim:20", 5, (0, 0, 1))
                assert (options.seed, vehicle.speed, options.identity) == (11, 8.0, None)
                assert vehicle.connect().target_system == 5
    """)
    run("--tiltwing-speed", "8", "--strict-markers", "--strict-config").assert_outcomes(passed=1)


def test_vehicles_of_parallel_workers_do_not_meet(
    pytester: pytest.Pytester, run: Callable[..., pytest.RunResult]
) -> None:
    pytester.makepyfile("""
        import pytest
        from pathlib import Path
        from pymavlink import mavutil

        @pytest.mark.parametrize("system", [11, 12])
        def test_each(tiltwing_sitl_factory, system):
            vehicles = [tiltwing_sitl_factory(system_id=system), tiltwing_sitl_factory(system_id=system + 100)]
            Path(f"{system}.pids").write_text(" ".join(str(vehicle.pid) for vehicle in vehicles))
            for vehicle in vehicles:
                client = mavutil.mavlink_connection(vehicle.connection)
                for _ in range(3):
                    message = client.recv_match(type="ATTITUDE", blocking=True, timeout=10)
                    assert message.get_srcSystem() == vehicle.system_id
                client.close()
    """)
    run("-n", "2").assert_outcomes(passed=2)
    pids = [int(pid) for file in pytester.path.glob("*.pids") for pid in file.read_text().split()]
    assert len(set(pids)) == 4
    assert all(map(is_gone, pids))


def test_a_failed_test_shows_the_vehicles_log_and_leaves_no_process(
    pytester: pytest.Pytester, run: Callable[..., pytest.RunResult]
) -> None:
    pytester.makepyfile("""
        def test_it(tiltwing_sitl):
            print(f"pid {tiltwing_sitl.pid}.")
            while "Tilt-wing" not in tiltwing_sitl.log:
                pass
            assert False
    """)
    result = run()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*Log of tiltwing_sitl, system 1*", "Tilt-wing, system 1: on the ground*"])
    found = re.search(r"pid (\d+)\.", result.stdout.str())
    assert found is not None
    assert is_gone(int(found[1]))


@pytest.mark.parametrize(
    ("marker", "expected"),
    [
        (
            'at="nowhere"',
            "*the vehicle ended with exit code 2 before its first HEARTBEAT*nowhere*there is no such file*",
        ),
        ("colour=1", "*expected an option among speed, seed, * got 'colour'*"),
        ("10", "*tiltwing_sitl: expected options with their names, as in speed=10, got (10,)*"),
    ],
)
def test_a_vehicle_that_cannot_start_is_one_clear_error(
    pytester: pytest.Pytester, run: Callable[..., pytest.RunResult], marker: str, expected: str
) -> None:
    pytester.makepyfile(f"""
        import pytest

        @pytest.mark.tiltwing_sitl({marker})
        def test_it(tiltwing_sitl):
            pass
    """)
    result = run()
    result.assert_outcomes(errors=1)
    assert re.search(".*".join(map(re.escape, expected.split("*"))), result.stdout.str(), re.DOTALL)
    assert "sitl/testing/process.py" not in result.stdout.str()


def test_a_vehicle_that_crashes_in_a_test_that_passes_is_an_error(
    pytester: pytest.Pytester, run: Callable[..., pytest.RunResult]
) -> None:
    pytester.makepyfile("""
        import os, signal

        def test_it(tiltwing_sitl):
            os.kill(tiltwing_sitl.pid, signal.SIGKILL)
            while tiltwing_sitl.is_running:
                pass
    """)
    result = run()
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*SitlError: the vehicle ended by itself with exit code -9"])


def test_no_vehicle_outlives_a_pytest_that_is_killed(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("""
        from pathlib import Path

        def test_it(tiltwing_sitl):
            Path("new").write_text(str(tiltwing_sitl.pid))
            Path("new").rename("pid")
            while True:
                tiltwing_sitl.connect().recv_match(blocking=True, timeout=1)
    """)
    command = [sys.executable, "-m", "pytest", "-q", *NO_CACHE]
    # What it leaves behind in the folder for temporary files goes with the folder of this test.
    environment = {**os.environ, "TMPDIR": str(pytester.path)}
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment)
    try:
        told = pytester.path / "pid"
        wait_until(told.exists)
        vehicle = int(told.read_text())
        assert not is_gone(vehicle)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    wait_until(lambda: is_gone(vehicle))


def test_a_fixture_of_ones_own_can_share_a_vehicle(
    pytester: pytest.Pytester, run: Callable[..., pytest.RunResult]
) -> None:
    pytester.makepyfile("""
        import pytest
        from sitl.testing import SitlVehicle

        @pytest.fixture(scope="module")
        def shared(tiltwing_sitl_options):
            with SitlVehicle(**{**tiltwing_sitl_options, "at": "trim:20"}) as vehicle:
                yield vehicle

        @pytest.fixture
        def cruising(shared):
            shared.wire.restore()
            shared.reset()
            return shared

        pids = set()

        @pytest.mark.parametrize("number", [1, 2])
        def test_it(cruising, number):
            pids.add(cruising.pid)
            assert len(pids) == 1
            assert cruising.options.seed == 3
            cruising.wire.silence()
    """)
    run("--tiltwing-seed", "3").assert_outcomes(passed=2)


@pytest.mark.parametrize("option", ["--tiltwing-seed=x", "--tiltwing-start-timeout=soon"])
def test_a_wrong_option_of_the_command_line_is_refused_before_any_test(
    run: Callable[..., pytest.RunResult], option: str
) -> None:
    result = run(option)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert option.partition("=")[0] in result.stderr.str()


def test_who_uses_no_vehicle_loads_nothing_of_it(
    pytester: pytest.Pytester, run: Callable[..., pytest.RunResult]
) -> None:
    pytester.makepyfile("""
        import sys

        def test_it():
            heavy = {"numpy", "numba", "pymavlink", "msgspec", "sitl.cli", "sitl.testing.vehicle"}
            assert not heavy & set(sys.modules)
            assert "sitl.testing.plugin" in sys.modules
    """)
    run("-p", "no:hypothesispytest").assert_outcomes(passed=1)


def test_the_example_in_the_documents_passes(pytester: pytest.Pytester, run: Callable[..., pytest.RunResult]) -> None:
    pytester.makepyfile(test_my_client=EXAMPLE.read_text())
    result = run("-ra")
    assert result.ret == 0, result.stdout.str()
    assert "skipped" not in result.stdout.str()
