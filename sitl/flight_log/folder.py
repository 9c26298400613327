"""The folder of flight logs: names, what is there, and that it does not grow without bound.

A log is named `log_NUMBER_UTC.ulg`, counted from 1. Files of other names are not ours: never listed, never deleted.
"""

import re
import stat
from collections import deque
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

__all__ = ["MOST_BYTES", "MOST_LOGS", "LogFile", "LogFolder"]

MOST_LOGS = 100  # the oldest go when one more begins
MOST_BYTES = 500_000_000  # of all together, likewise

_NAME = re.compile(r"log_(\d{1,9})_(\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d)\.ulg")
_UTC = "%Y-%m-%d-%H-%M-%S"
_LATEST = datetime(9999, 12, 31, 23, 59, 59, tzinfo=UTC).timestamp()


class LogFile(NamedTuple):
    """One log as it is now."""

    path: Path
    number: int
    utc: int  # at which it begins [s since 1970]
    size: int  # on the disk [bytes]


class LogFolder:
    """Logs in a folder that need not be there yet."""

    def __init__(self, path: Path) -> None:
        self.path = path
        # Logs that were named and need not be on the disk yet: the latest number, and times.
        self._latest = 0
        self._named: deque[int] = deque(maxlen=MOST_LOGS)

    def logs(self) -> list[LogFile]:
        """All logs, oldest first; none where the folder cannot be read."""
        found: list[LogFile] = []
        try:
            for path in self.path.iterdir():
                log = _log(path)
                if log is not None:
                    found.append(log)
        except OSError:
            return []
        return sorted(found, key=lambda log: log.number)

    def next_path(self, utc: float) -> Path:
        """Where the next log goes, which begins at `utc` [s since 1970].

        No two logs get the same time, for ground stations tell them apart by it: the next free second is taken.
        """
        logs = self.logs()
        taken = {*self._named, *(log.utc for log in logs)}
        second = int(min(max(utc, 0.0), _LATEST - 2 * MOST_LOGS))
        while second in taken:
            second += 1
        self._latest = max(self._latest, logs[-1].number if logs else 0) + 1
        self._named.append(second)
        return self.path / f"log_{self._latest}_{datetime.fromtimestamp(second, UTC):{_UTC}}.ulg"

    def make_room(self, size: int) -> None:
        """Make the folder, and room in it for one more log of this size; raises OSError where that fails."""
        self.path.mkdir(parents=True, exist_ok=True)
        logs = self.logs()
        total = sum(log.size for log in logs)
        while logs and (len(logs) >= MOST_LOGS or total + size > MOST_BYTES):
            oldest = logs.pop(0)
            oldest.path.unlink(missing_ok=True)
            total -= oldest.size

    def erase(self) -> None:
        """Delete all logs; raises OSError for the first that cannot be."""
        for log in self.logs():
            log.path.unlink(missing_ok=True)


def _log(path: Path) -> LogFile | None:
    """The log at a path; None if it is none, or has just gone."""
    matched = _NAME.fullmatch(path.name)
    if matched is None:
        return None
    try:
        utc = datetime.strptime(matched[2], _UTC).replace(tzinfo=UTC).timestamp()
        info = path.lstat()
        return LogFile(path, int(matched[1]), int(utc), info.st_size) if stat.S_ISREG(info.st_mode) else None
    except (ValueError, OSError):
        return None
