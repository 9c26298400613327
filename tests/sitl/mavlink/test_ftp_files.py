"""Nobody gets out of the directory that MAVLink FTP serves, or more into it than it may hold."""

import errno
import os
import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from sitl.mavlink import ftp_files
from sitl.mavlink.ftp_files import FileTree, VirtualFile

SECRET = b"secret"


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    folder = tmp_path / "outside"
    folder.mkdir()
    (folder / "secret").write_bytes(SECRET)
    return folder


@pytest.fixture
def root(tmp_path: Path, outside: Path) -> Path:  # noqa: ARG001
    folder = tmp_path / "root"
    folder.mkdir()
    return folder


@pytest.fixture
def tree(root: Path) -> Iterator[FileTree]:
    made = FileTree(root, {})
    yield made
    made.close()


def attempts(tree: FileTree, path: str) -> dict[str, Callable[[], object]]:
    """Everything that can be asked for a path."""
    return {
        "open": lambda: tree.open(path).read(0, 100),
        "listing": lambda: tree.listing(path),
        "create": lambda: tree.create(path, truncate=True),
        "write": lambda: tree.create(path, truncate=False),
        "truncate": lambda: tree.truncate(path, 0),
        "remove": lambda: tree.remove(path),
        "make_directory": lambda: tree.make_directory(path),
        "remove_directory": lambda: tree.remove_directory(path),
        "rename": lambda: tree.rename(path, "/taken"),
        "rename to": lambda: tree.rename("/own", path),
    }


def refused(attempt: Callable[[], object], what: str = "") -> int:
    """The errno with which an attempt is refused."""
    try:
        attempt()
    except OSError as error:
        return error.errno or 0
    pytest.fail(f"not refused: {what}")


def seen(folder: Path) -> dict[str, bytes | None]:
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() and not path.is_symlink() else None
        for path in sorted(folder.rglob("*"))
    }


@pytest.mark.parametrize(
    "path",
    [
        "..",
        "../outside/secret",
        "/../outside/secret",
        "a/../../outside/secret",
        "own/../../outside/secret",
        "./../outside/secret",
        "/etc/../../outside/secret",
        "/..",
        "/a/..",
        "../root/own",
        "@PARAM/../../outside/secret",
    ],
)
def test_no_path_leads_upwards(tree: FileTree, root: Path, outside: Path, path: str) -> None:
    (root / "own").write_bytes(b"own")
    before = seen(root), seen(outside)
    for name, attempt in attempts(tree, path).items():
        assert refused(attempt, name) == errno.EACCES
    assert (seen(root), seen(outside)) == before


def test_an_absolute_path_counts_from_the_root(tree: FileTree, root: Path, outside: Path) -> None:
    with pytest.raises(FileNotFoundError):
        tree.open(str(outside / "secret"))
    with pytest.raises(FileNotFoundError):
        tree.open("/etc/passwd")
    (root / "a").write_bytes(b"1")
    assert tree.open("//a").read(0, 9) == tree.open("/./a").read(0, 9) == tree.open("a").read(0, 9) == b"1"


@pytest.mark.parametrize("target", ["../outside", "absolute"])
def test_no_symbolic_link_is_followed_wherever_it_stands_in_a_path(
    tree: FileTree, root: Path, outside: Path, target: str
) -> None:
    to = str(outside) if target == "absolute" else target
    (root / "link").symlink_to(to)
    (root / "file").symlink_to(f"{to}/secret")
    (root / "own").write_bytes(b"own")
    before = seen(outside)
    for path in ("/link/secret", "/link", "/file", "/link/new"):
        for name, attempt in attempts(tree, path).items():
            if name in {"remove", "rename"} and path in {"/link", "/file"}:
                continue  # what is removed or renamed is the link itself
            assert refused(attempt, f"{name} {path}")
    assert seen(outside) == before
    assert {entry.kind for entry in tree.listing("/") if entry.name != b"own"} == {"S"}
    tree.remove("/file")
    tree.rename("/link", "/other")
    assert seen(outside) == before


def test_a_directory_changed_into_a_link_between_two_steps_leads_nowhere(
    tree: FileTree, root: Path, outside: Path
) -> None:
    """Somebody swaps a directory for a link all the time while it is walked."""
    (root / "d").mkdir()
    (root / "d" / "secret").write_bytes(b"own")
    stop = threading.Event()

    def swap() -> None:
        while not stop.is_set():
            (root / "d").rename(root / "kept")
            (root / "d").symlink_to(outside)
            (root / "d").unlink()
            (root / "kept").rename(root / "d")

    swapper = threading.Thread(target=swap)
    swapper.start()
    try:
        got: set[bytes] = set()
        for _ in range(3000):
            try:
                file = tree.open("/d/secret")
                got.add(file.read(0, 100))
                file.close(complete=False)
                written = tree.create("/d/new", truncate=True)
                written.write(0, b"x")
                written.close(complete=True)
            except OSError:
                continue
    finally:
        stop.set()
        swapper.join()
    assert got == {b"own"}
    assert seen(outside) == {"secret": SECRET}


def test_an_open_file_stays_the_one_that_was_opened(tree: FileTree, root: Path, outside: Path) -> None:
    (root / "a").write_bytes(b"own")
    file = tree.open("/a")
    (root / "a").unlink()
    (root / "a").symlink_to(outside / "secret")
    assert file.read(0, 100) == b"own"


@pytest.mark.parametrize("path", ["a\0b", "\0", "a\0/../../outside/secret"])
def test_a_zero_in_a_path_is_refused(tree: FileTree, path: str) -> None:
    for attempt in attempts(tree, path).values():
        assert refused(attempt)


def test_names_of_any_length_and_depth_are_refused_or_work(tree: FileTree) -> None:
    assert refused(lambda: tree.create("n" * 256, truncate=True)) == errno.ENAMETOOLONG
    tree.create("n" * 255, truncate=True).close(complete=True)
    for depth in range(1, 100):
        tree.make_directory("/".join("d" * depth))
    tree.create("/".join("d" * 99) + "/x", truncate=True).close(complete=True)


def test_a_pipe_or_device_is_no_file_and_nobody_waits_for_it(tree: FileTree, root: Path) -> None:
    os.mkfifo(root / "pipe")
    for name in ("open", "create", "write", "truncate"):
        assert refused(attempts(tree, "/pipe")[name]) == errno.EACCES
    assert [entry.kind for entry in tree.listing("/")] == ["S"]


def test_a_file_does_not_grow_beyond_its_limit(tree: FileTree, root: Path) -> None:
    file = tree.create("/a", truncate=True)
    file.write(ftp_files.LARGEST_FILE - 1, b"x")
    for offset in (ftp_files.LARGEST_FILE, ftp_files.LARGEST_FILE - 1, 0xFFFFFFFF):
        assert refused(partial(file.write, offset, b"xx")) == errno.EFBIG
    assert (root / "a").stat().st_size == ftp_files.LARGEST_FILE


def test_all_files_together_keep_to_their_limit_and_what_goes_makes_room(
    tree: FileTree, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ftp_files, "LARGEST_TOTAL", 1000)

    def write(name: str, size: int) -> None:
        file = tree.create(name, truncate=True)
        try:
            file.write(0, bytes(size))
        finally:
            file.close(complete=True)

    write("/a", 600)
    assert refused(lambda: write("/b", 401)) == errno.ENOSPC
    write("/b", 400)
    write("/b", 400)  # in place of what was there
    tree.truncate("/a", 500)
    write("/c", 100)
    tree.remove("/b")
    write("/d", 400)
    (root / "d").unlink()  # by somebody else
    write("/e", 400)


def test_there_are_not_more_files_than_can_be_listed(tree: FileTree, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ftp_files, "MOST_FILES", 3)
    tree.make_directory("/d")
    for name in ("/d/a", "/d/b"):
        tree.create(name, truncate=True).close(complete=True)
    for attempt in (lambda: tree.create("/c", truncate=True), lambda: tree.make_directory("/e")):
        assert refused(attempt) == errno.ENOSPC
    tree.create("/d/a", truncate=True).close(complete=True)
    tree.remove("/d/a")
    tree.create("/c", truncate=True).close(complete=True)


def test_no_descriptor_is_left_open(tree: FileTree, root: Path) -> None:
    (root / "a").write_bytes(b"1")
    (root / "d").mkdir()
    (root / "link").symlink_to("/")

    def descriptors() -> int:
        return len(list(Path("/proc/self/fd").iterdir()))

    before = descriptors()
    for path in ("/a", "/d", "/d/x/y", "/link", "/link/x", "..", "/missing"):
        for attempt in (tree.open, tree.listing, lambda path: tree.create(path, truncate=False)):
            try:
                made = attempt(path)
            except OSError:
                continue
            if not isinstance(made, list):
                made.close(complete=False)
        for attempt in (lambda path: tree.truncate(path, 0), tree.remove, lambda path: tree.rename(path, "/other")):
            try:
                attempt(path)
            except OSError:
                continue
    assert descriptors() == before


# -- mounts ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def mounted(root: Path, outside: Path) -> Iterator[FileTree]:
    stored: list[bytes] = []

    def store(data: bytes) -> None:
        if data == b"bad":
            msg = "will not do"
            raise ValueError(msg)
        stored.append(data)

    made = FileTree(
        root,
        {
            "/etc/extras/constant": b"constant",
            "@PARAM/made": lambda query: f"made {query}".encode(),
            "@PARAM/upload": VirtualFile(lambda _: stored[-1] if stored else b"", store),
            "/fs/log": outside,
            "@LOG": outside,
            "/missing": outside / "missing",
        },
    )
    yield made
    made.close()


def test_mounts_are_found_and_listed_beside_files(mounted: FileTree, root: Path) -> None:
    (root / "own").write_bytes(b"1")
    (root / "etc").mkdir()
    (root / "etc" / "own").write_bytes(b"12")
    assert mounted.open("etc/extras/constant").read(0, 99) == b"constant"
    assert mounted.open("@PARAM/made").read(0, 99) == b"made "
    assert mounted.open("@PARAM/made?a=1&b").read(0, 99) == b"made a=1&b"
    assert mounted.open("/fs/log/secret").read(0, 99) == mounted.open("@LOG/secret").read(0, 99) == SECRET
    names = [(entry.kind, entry.name) for entry in mounted.listing("/")]
    assert names == [
        ("D", b"@LOG"), ("D", b"@PARAM"), ("D", b"etc"), ("D", b"fs"), ("D", b"missing"), ("F", b"own"),
    ]  # fmt: skip
    assert [(entry.name, entry.size) for entry in mounted.listing("/etc")] == [(b"extras", 0), (b"own", 2)]
    assert [(entry.name, entry.size) for entry in mounted.listing("@PARAM")] == [(b"made", 5), (b"upload", 0)]
    assert [entry.name for entry in mounted.listing("/fs/log")] == [b"secret"]
    assert mounted.listing("/missing") == []


def test_an_unknown_virtual_directory_is_not_found(mounted: FileTree) -> None:
    for path in ("@FOO", "@FOO/x", "@"):
        for name, attempt in attempts(mounted, path).items():
            if name != "rename to":
                assert refused(attempt, name) == errno.ENOENT


def test_what_is_mounted_cannot_be_changed(mounted: FileTree, outside: Path) -> None:
    before = seen(outside)
    for path in ("/etc/extras/constant", "@PARAM/made", "/fs/log/secret", "/fs/log/new", "@LOG/secret", "/fs/log"):
        for name in (
            "create",
            "write",
            "truncate",
            "remove",
            "make_directory",
            "remove_directory",
            "rename",
            "rename to",
        ):
            assert refused(attempts(mounted, path)[name], f"{name} {path}") in (errno.EACCES, errno.EEXIST)
    for path in ("/", "/etc", "/etc/extras", "/fs", "@PARAM"):
        for name in ("remove_directory", "rename", "rename to", "make_directory"):
            assert refused(attempts(mounted, path)[name], f"{name} {path}") in (errno.EACCES, errno.EEXIST)
    assert seen(outside) == before


def test_files_can_be_put_beside_what_is_mounted(mounted: FileTree, root: Path) -> None:
    file = mounted.create("/fs/own", truncate=True)
    file.write(0, b"1")
    file.close(complete=True)
    assert (root / "fs" / "own").read_bytes() == b"1"
    assert [entry.name for entry in mounted.listing("/fs")] == [b"log", b"own"]
    with pytest.raises(FileNotFoundError):
        mounted.create("/nowhere/own", truncate=True)


def test_an_upload_to_a_virtual_file_is_stored_once_it_is_complete(mounted: FileTree) -> None:
    file = mounted.create("@PARAM/upload", truncate=True)
    file.write(3, b"45")
    file.write(0, b"123")
    assert mounted.open("@PARAM/upload").read(0, 99) == b""
    file.close(complete=True)
    assert mounted.open("@PARAM/upload").read(0, 99) == b"12345"
    given_up = mounted.create("@PARAM/upload", truncate=True)
    given_up.write(0, b"other")
    given_up.close(complete=False)
    assert mounted.open("@PARAM/upload").read(0, 99) == b"12345"
    bad = mounted.create("@PARAM/upload", truncate=True)
    bad.write(0, b"bad")
    with pytest.raises(ValueError, match="will not do"):
        bad.close(complete=True)


def test_an_upload_that_is_too_large_for_a_virtual_file_is_refused(mounted: FileTree) -> None:
    file = mounted.create("@PARAM/upload", truncate=True)
    assert refused(lambda: file.write(1 << 20, b"x")) == errno.EFBIG


def test_a_link_inside_a_mounted_directory_is_not_followed(mounted: FileTree, outside: Path) -> None:
    (outside / "link").symlink_to("/etc/passwd")
    assert refused(lambda: mounted.open("/fs/log/link"))
