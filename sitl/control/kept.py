"""Arrays kept on disk from one run to the next: whole, or not at all."""

import tempfile
import zipfile
from pathlib import Path

import numpy as np
from numpy.lib.npyio import NpzFile

__all__ = ["keep", "kept"]


def keep(file: Path | None, **arrays: np.ndarray) -> None:
    """Write named arrays so that another process sees all of them or nothing; a disk that takes none is no error."""
    if file is None:
        return
    try:
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".partial", delete=False) as stream:
            np.savez(stream, allow_pickle=False, **arrays)
        Path(stream.name).replace(file)
    except OSError:  # a full disk, or a folder that is gone: the next process makes them again
        return


def kept(file: Path | None) -> dict[str, np.ndarray] | None:
    """Arrays written before, by name, or None where there are none that can be read."""
    if file is None:
        return None
    try:
        with file.open("rb") as stream:
            found = np.load(stream)
            return dict(found) if isinstance(found, NpzFile) else None
    except (OSError, ValueError, EOFError, zipfile.BadZipFile):
        return None
