"""Files that MAVLink FTP serves: a directory that nobody can leave, and virtual files mounted into it.

Every path is walked from the root one name at a time, each opened relative to the directory before it and never through
a symbolic link. So no link leads out, not even one that is put there between two steps, and a name is never resolved
twice. Needs an operating system that opens files relative to directories (Linux, macOS).
"""

import errno
import os
import stat
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, NamedTuple

from sitl.mavlink.ftp_open_files import FILE, Content, DiskFile, OpenFile, Upload, open_regular

__all__ = ["Entry", "FileTree", "Mount", "VirtualFile"]

LARGEST_FILE: Final = 64 << 20  # bytes
LARGEST_TOTAL: Final = 256 << 20
MOST_FILES: Final = 1024  # and directories: what a client may have listed again and again

_ROOT = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
_DIRECTORY = _ROOT | os.O_NOFOLLOW
Parts = tuple[str, ...]  # of a path: names below the root


class VirtualFile(NamedTuple):
    """A file that is made when it is opened: `content` gets what follows a "?" in the path, and may raise OSError.

    With `store` it can be written as a whole: `store` gets what was uploaded and raises ValueError if it will not do.
    """

    content: Callable[[str], bytes]
    store: Callable[[bytes], None] | None = None


# What can stand at a path: constant bytes, bytes made at opening, a file that takes uploads too, a directory to read.
Mount = bytes | Callable[[str], bytes] | VirtualFile | Path


class Entry(NamedTuple):
    """One name in a directory."""

    kind: str  # F file, D directory, S something to pass over
    name: bytes
    size: int = 0  # bytes
    modified: int = 0  # seconds since 1970, 0 unknown


class FileTree:
    """The directory `root` with mounts in it. All methods raise OSError, with the errno that fits."""

    def __init__(self, root: Path, mounts: Mapping[str, Mount]) -> None:
        """Open the directory. Paths of mounts are absolute ("/etc/x") or virtual ("@PARAM/x")."""
        self._root = os.open(root, _ROOT)
        self._mounts = {_parts(path): _as_mount(mount) for path, mount in mounts.items()}
        self._virtual = {parts[:depth] for parts in self._mounts for depth in range(len(parts))}
        self._count = self._bytes = 0
        self._recount()

    def close(self) -> None:
        """Close the directory."""
        os.close(self._root)

    # -- reading -------------------------------------------------------------------------------------------------

    def open(self, path: str) -> OpenFile:
        """Open a file for reading."""
        name, _, query = path.partition("?")
        mount = self._mounts.get(_parts(name))
        if isinstance(mount, VirtualFile):
            return Content(mount.content(query))
        root, parts = self._place(_parts(path))
        with self._below(root, parts[:-1]) as directory:
            return DiskFile(open_regular(_name(parts), os.O_RDONLY, directory))

    def listing(self, path: str) -> list[Entry]:
        """What a directory holds, by name."""
        parts = _parts(path)
        if isinstance(self._mounts.get(parts), VirtualFile):
            raise NotADirectoryError(errno.ENOTDIR, "a file")
        entries: dict[bytes, Entry] = {}
        try:
            root, rest = self._place(parts)
            with self._below(root, rest) as directory:
                entries = {entry.name: entry for entry in _scan(directory)}
        except FileNotFoundError:
            if parts not in self._virtual and parts not in self._mounts:
                raise
        for mounted in self._mounts:
            if len(mounted) > len(parts) and mounted[: len(parts)] == parts:
                entry = self._mounted_entry(mounted[: len(parts) + 1])
                entries[entry.name] = entry
        return [entries[name] for name in sorted(entries)]

    # -- changing ------------------------------------------------------------------------------------------------

    def create(self, path: str, *, truncate: bool) -> OpenFile:
        """Open a file for writing; it is made if there is none, and emptied if asked for."""
        parts = _parts(path)
        mount = self._mounts.get(parts)
        if isinstance(mount, VirtualFile) and mount.store is not None:
            return Upload(mount.store)
        self._check_ours(parts)
        with self._below(self._root, parts[:-1], make=True) as directory:
            name = _name(parts)
            if self._count >= MOST_FILES:
                self._recount()
            making = os.O_CREAT | os.O_EXCL if self._count < MOST_FILES else 0
            try:
                descriptor = os.open(name, os.O_WRONLY | making | FILE, 0o644, dir_fd=directory)
                self._count += 1
            except FileExistsError:
                descriptor = open_regular(name, os.O_WRONLY, directory)
            except FileNotFoundError:
                raise OSError(errno.ENOSPC, "too many files") from None
        file = DiskFile(descriptor, self._grow)
        if truncate:
            self._resize(descriptor, 0)
        return file

    def truncate(self, path: str, size: int) -> None:
        """Cut a file to this length; it cannot be made longer."""
        parts = _parts(path)
        self._check_ours(parts)
        with self._below(self._root, parts[:-1]) as directory:
            descriptor = open_regular(_name(parts), os.O_WRONLY, directory)
        try:
            if size > os.fstat(descriptor).st_size:
                raise OSError(errno.EINVAL, "longer than the file")
            self._resize(descriptor, size)
        finally:
            os.close(descriptor)

    def remove(self, path: str) -> None:
        """Remove a file."""
        parts = _parts(path)
        self._check_ours(parts)
        with self._below(self._root, parts[:-1]) as directory:
            name = _name(parts)
            status = os.stat(name, dir_fd=directory, follow_symlinks=False)
            if stat.S_ISDIR(status.st_mode):
                raise IsADirectoryError(errno.EISDIR, "a directory")
            os.unlink(name, dir_fd=directory)
            self._count -= 1
            self._bytes -= status.st_size

    def make_directory(self, path: str) -> None:
        """Make a directory."""
        parts = _parts(path)
        if not parts or parts in self._virtual:
            raise FileExistsError(errno.EEXIST, "there already")
        self._check_ours(parts)
        with self._below(self._root, parts[:-1], make=True) as directory:
            self._make_directory(parts[-1], directory)

    def remove_directory(self, path: str) -> None:
        """Remove an empty directory."""
        parts = _parts(path)
        if not parts or parts in self._virtual:
            raise PermissionError(errno.EACCES, "always there")
        self._check_ours(parts)
        with self._below(self._root, parts[:-1]) as directory:
            os.rmdir(parts[-1], dir_fd=directory)
            self._count -= 1

    def rename(self, path: str, new_path: str) -> None:
        """Give a file or directory another path, which must be free."""
        old, new = _parts(path), _parts(new_path)
        for parts in (old, new):
            if not parts or parts in self._virtual:
                raise PermissionError(errno.EACCES, "always there")
            self._check_ours(parts)
        with (
            self._below(self._root, old[:-1]) as here,
            self._below(self._root, new[:-1], make=True) as there,
        ):
            os.stat(old[-1], dir_fd=here, follow_symlinks=False)
            with suppress(FileNotFoundError):
                os.stat(new[-1], dir_fd=there, follow_symlinks=False)
                raise FileExistsError(errno.EEXIST, "there already")
            os.rename(old[-1], new[-1], src_dir_fd=here, dst_dir_fd=there)

    # -- inside --------------------------------------------------------------------------------------------------

    def _grow(self, descriptor: int, size: int) -> None:
        """Let a file that is to be written have at least this length, or raise OSError: no space."""
        growth = size - os.fstat(descriptor).st_size
        if growth <= 0:
            return
        if size > LARGEST_FILE:
            raise OSError(errno.EFBIG, "too large")
        if self._bytes + growth > LARGEST_TOTAL:
            self._recount()  # somebody else may have cleared up
            if self._bytes + growth > LARGEST_TOTAL:
                raise OSError(errno.ENOSPC, "no space")
        self._bytes += growth

    def _resize(self, descriptor: int, size: int) -> None:
        before = os.fstat(descriptor).st_size
        os.ftruncate(descriptor, size)
        self._bytes -= before - size

    def _recount(self) -> None:
        self._count = self._bytes = 0
        for _, directories, files, directory in os.fwalk(".", dir_fd=self._root):
            self._count += len(directories) + len(files)
            for name in files:
                with suppress(OSError):
                    self._bytes += os.stat(name, dir_fd=directory, follow_symlinks=False).st_size

    def _place(self, parts: Parts) -> tuple[int | Path, Parts]:
        """Directory in which a path lies, ours or a mounted one, and the names below it."""
        for depth in range(len(parts), 0, -1):
            mount = self._mounts.get(parts[:depth])
            if isinstance(mount, Path):
                return mount, parts[depth:]
        if parts and parts[0].startswith("@"):
            raise FileNotFoundError(errno.ENOENT, "no such virtual directory")
        return self._root, parts

    def _check_ours(self, parts: Parts) -> None:
        """Raise PermissionError for what is mounted and cannot be changed."""
        if parts in self._mounts or self._place(parts)[0] is not self._root:
            raise PermissionError(errno.EACCES, "read only")

    @contextmanager
    def _below(self, root: int | Path, parts: Parts, *, make: bool = False) -> Generator[int]:
        """Descriptor of a directory; with `make` those are made on the way that are listed because of a mount."""
        if isinstance(root, Path):
            directory = os.open(root, _ROOT)
        else:
            directory = os.open(".", _DIRECTORY, dir_fd=root)
        try:
            for depth, name in enumerate(parts, start=1):
                if make and parts[:depth] in self._virtual:
                    with suppress(FileExistsError):
                        self._make_directory(name, directory)
                inner = os.open(name, _DIRECTORY, dir_fd=directory)
                os.close(directory)
                directory = inner
            yield directory
        finally:
            os.close(directory)

    def _make_directory(self, name: str, directory: int) -> None:
        if self._count >= MOST_FILES:
            self._recount()
            if self._count >= MOST_FILES:
                raise OSError(errno.ENOSPC, "too many files")
        os.mkdir(name, 0o755, dir_fd=directory)
        self._count += 1

    def _mounted_entry(self, parts: Parts) -> Entry:
        name = os.fsencode(parts[-1])
        mount = self._mounts.get(parts)
        if not isinstance(mount, VirtualFile):
            return Entry("D", name)
        try:
            return Entry("F", name, len(mount.content("")))
        except OSError:
            return Entry("F", name)


def _as_mount(mount: Mount) -> VirtualFile | Path:
    if isinstance(mount, VirtualFile | Path):
        return mount
    return VirtualFile(lambda _: mount) if isinstance(mount, bytes) else VirtualFile(mount)


def _parts(path: str) -> Parts:
    """Names of a path, which counts from the root with or without a slash before it; no name leads upwards."""
    parts = tuple(name for name in path.split("/") if name not in {"", "."})
    if ".." in parts or "\0" in path:
        raise PermissionError(errno.EACCES, "leads out")
    return parts


def _name(parts: Parts) -> str:
    if not parts:
        raise IsADirectoryError(errno.EISDIR, "a directory")
    return parts[-1]


def _scan(directory: int) -> Iterator[Entry]:
    with os.scandir(directory) as found:
        for item in found:
            name = os.fsencode(item.name)
            try:
                status = item.stat(follow_symlinks=False)
            except FileNotFoundError:
                continue
            modified = max(0, int(status.st_mtime))
            if stat.S_ISREG(status.st_mode):
                yield Entry("F", name, status.st_size, modified)
            else:
                yield Entry("D" if stat.S_ISDIR(status.st_mode) else "S", name, 0, modified)
