"""The state folder: what is in it is whole, whenever the power goes, and belongs to one process at a time."""

import os
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sitl.mavlink.state_folder import StateError, StateFolder


class PowerCutError(BaseException):
    """The process is gone: nothing after it runs but what cleans up, and no cleaning up belongs to what must hold."""


def test_what_is_written_is_read_by_the_next_process(tmp_path: Path) -> None:
    with StateFolder(tmp_path / "new" / "vehicle") as state:
        assert state.folder == tmp_path / "new" / "vehicle"
        assert state.read("plan.json") is None
        state.write("plan.json", b"first")
        state.write("plan.json", b"second")
        state.write("signing", bytes(range(256)))
        assert state.read("plan.json") == b"second"
    with StateFolder(tmp_path / "new" / "vehicle") as state:
        assert state.read("plan.json") == b"second"
        assert state.read("signing") == bytes(range(256))
        assert state.files.is_dir()
        assert state.logs.is_dir()
        state.remove("signing")
        state.remove("signing")
        assert state.read("signing") is None


def test_only_its_owner_can_read_what_is_stored(tmp_path: Path) -> None:
    with StateFolder(tmp_path) as state:
        state.write("signing", b"secret")
    assert stat.S_IMODE((tmp_path / "signing").stat().st_mode) == 0o600


def test_without_a_folder_things_are_kept_until_the_end_and_then_gone() -> None:
    state = StateFolder()
    assert state.folder is None
    state.write("plan.json", b"mission")
    (state.files / "notes.txt").write_text("hello")
    assert state.read("plan.json") == b"mission"
    root = state.files.parent
    assert state.logs.is_dir()
    state.close()
    assert not root.exists()
    state.close()


@pytest.mark.parametrize("where", ["open", "fsync", "replace", "folder"])
def test_after_a_power_cut_at_any_step_the_old_or_the_new_content_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    state = StateFolder(tmp_path)
    state.write("plan.json", b"old")
    steps: list[str] = []

    def cut(step: str, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            steps.append(step)
            name = "folder" if step == "fsync" and steps.count("fsync") == 2 else step
            if name == where:
                raise PowerCutError
            return real(*arguments, **named)

        return call

    with monkeypatch.context() as patched:
        patched.setattr(os, "open", cut("open", os.open))
        patched.setattr(os, "fsync", cut("fsync", os.fsync))
        patched.setattr(Path, "replace", cut("replace", Path.replace))
        with pytest.raises(PowerCutError):
            state.write("plan.json", b"new content, longer than the old one")
    # In this order: the content is on the disk before its name is, and the name before write returns.
    assert steps == ["open", "fsync", "replace", "open", "fsync"][: len(steps)]
    state.close()  # as the kernel does for a dead process
    with StateFolder(tmp_path) as after:
        expected = b"new content, longer than the old one" if where == "folder" else b"old"
        assert after.read("plan.json") == expected
        assert sorted(path.name for path in tmp_path.iterdir()) == ["files", "lock", "logs", "plan.json"]


def test_a_write_that_fails_leaves_the_old_content_and_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    with StateFolder(tmp_path) as state:
        state.write("plan.json", b"old")
        with monkeypatch.context() as patched:
            patched.setattr(os, "fsync", full)
            with pytest.raises(StateError, match=r"plan\.json: No space left on device") as failure:
                state.write("plan.json", b"new")
        assert "\n" not in str(failure.value)
        assert state.read("plan.json") == b"old"
        assert not (tmp_path / "plan.json.new").exists()


def test_a_damaged_file_is_set_aside_and_replaces_the_one_before(tmp_path: Path) -> None:
    with StateFolder(tmp_path) as state:
        for content in (b"bad", b"worse"):
            state.write("plan.json", content)
            assert state.set_aside("plan.json") == "plan.json.bad"
            assert state.read("plan.json") is None
            assert (tmp_path / "plan.json.bad").read_bytes() == content
        with pytest.raises(StateError, match=r"plan\.json: No such file"):
            state.set_aside("plan.json")


def test_a_second_user_is_refused_with_the_first_ones_process_until_it_closes(tmp_path: Path) -> None:
    first = StateFolder(tmp_path)
    with pytest.raises(
        StateError, match=f"expected one for this vehicle alone, got one that process {os.getpid()} uses"
    ):
        StateFolder(tmp_path)
    first.write("plan.json", b"still works")
    first.close()
    StateFolder(tmp_path).close()


def test_another_process_holds_the_folder_until_it_is_killed(tmp_path: Path) -> None:
    program = "import sys; from sitl.mavlink.state_folder import StateFolder as S; s = S(sys.argv[1]); print(); input()"
    command = [sys.executable, "-c", program, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        other.stdout.readline()
        with pytest.raises(StateError, match=f"process {other.pid} uses"):
            StateFolder(tmp_path)
        other.kill()
        other.wait(10)
    StateFolder(tmp_path).close()


def test_a_folder_that_cannot_be_had_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(StateError, match=f"state folder {folder}: expected a folder to write to, got"):
            StateFolder(folder)


def test_what_cannot_be_read_is_told_in_one_line(tmp_path: Path) -> None:
    with StateFolder(tmp_path) as state:
        (tmp_path / "plan.json").mkdir()
        with pytest.raises(StateError, match=r"plan\.json: Is a directory"):
            state.read("plan.json")
        with pytest.raises(StateError, match=r"plan\.json: "):
            state.write("plan.json", b"")


@pytest.mark.parametrize("name", ["../plan.json", "/etc/passwd", "files/x", "", ".", "..", "lock"])
def test_names_are_plain_file_names(tmp_path: Path, name: str) -> None:
    with StateFolder(tmp_path) as state, pytest.raises(ValueError, match="expected a plain file name"):
        state.write(name, b"")
