"""What a person at the terminal sees: lines of text and, on a terminal, one live line that rewrites itself.

A thread of its own writes, for a terminal can stand still (Ctrl-S, a full pipe) and the flight must not.
"""

import queue
import shutil
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TextIO

__all__ = ["Report", "Status"]

LIVE_PERIOD = 0.5  # [s], on a terminal
LOG_PERIOD = 10.0  # [s], elsewhere
CLEAR_LINE = "\r\x1b[K"
LONG_FLIGHT = 1000.0  # [s], of which nobody looks at the tenths
LOSSES = ("dropped", "malformed")


@dataclass(frozen=True, slots=True)
class Report:
    """How the process does at one moment; handed over by the flight loop."""

    time: float  # simulated [s]
    wall_time: float  # monotonic [s]
    state: str
    late_ticks: int
    dropped_ticks: int
    links: Mapping[str, Mapping[str, int]]  # counters by connection string, as `MavlinkFace.statistics` gives them
    viewer_dropped: int


class Status:
    """Writes to `stream` from its own thread; nothing called here ever waits for it."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._live = stream.isatty()
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._report: Report | None = None
        self._shown: Report | None = None
        self._thread = threading.Thread(target=self._write, name="status", daemon=True)
        self._thread.start()

    @property
    def period(self) -> float:
        """Wall time between reports worth offering [s]."""
        return LIVE_PERIOD if self._live else LOG_PERIOD

    def say(self, line: str) -> None:
        """Print a line, above the live one where there is one."""
        self._lines.put(line)

    def offer(self, report: Report) -> None:
        """Show this report next; one not yet shown is forgotten."""
        self._report = report
        self._lines.put("")

    def is_writing(self) -> bool:
        """True until everything is written after `close`, or nobody reads any more."""
        return self._thread.is_alive()

    def close(self, deadline: float = 1.0) -> None:
        """Write what is left, giving up after `deadline` wall seconds."""
        self._lines.put(None)
        self._thread.join(deadline)

    def _write(self) -> None:
        try:
            while (line := self._lines.get()) is not None:
                report = self._report
                if report is not None and report is not self._shown:
                    # A live line longer than the terminal is wide would wrap, and could not be rewritten.
                    width = shutil.get_terminal_size().columns - 1 if self._live else None
                    text = describe(report, self._shown, width)
                    self._stream.write(f"{CLEAR_LINE}{text}" if self._live else f"{text}\n")
                    self._shown = report
                if line:
                    self._stream.write(f"{CLEAR_LINE if self._live else ''}{line}\n")
                self._stream.flush()
            if self._live and self._shown is not None:
                self._stream.write("\n")
                self._stream.flush()
        except (OSError, ValueError):
            # Nobody reads any more (closed pipe or terminal); the flight goes on without an audience.
            return


def describe(report: Report, before: Report | None, width: int | None = None) -> str:
    """One line for a report; the real-time factor is that since the report before it.

    Where the line would be longer than `width` characters the links are summed up; if that does not do, the end
    of the state is cut.
    """
    flight = f"t {report.time:.{0 if report.time >= LONG_FLIGHT else 1}f} s"
    if before is not None and report.wall_time > before.wall_time:
        factor = (report.time - before.time) / (report.wall_time - before.wall_time)
        flight += f" {factor:.{2 if factor < 10.0 else 0}f}x"
    flight += f" late {report.late_ticks}"
    if report.dropped_ticks:
        flight += f" dropped {report.dropped_ticks}"
    if report.viewer_dropped:
        flight += f" viewer dropped {report.viewer_dropped}"
    each = ", ".join(f"{_port(name)} {_traffic(counters)}" for name, counters in report.links.items())
    line = f"{flight} | {each} | {report.state}"
    if width is None or len(line) <= width:
        return line
    total = {key: sum(counters[key] for counters in report.links.values()) for key in ("tx", "rx", *LOSSES)}
    return f"{flight} | {_traffic(total)} | {report.state}"[:width]


def _port(link: str) -> str:
    return link.partition(",")[0].rpartition(":")[2]


def _traffic(counters: Mapping[str, int]) -> str:
    """Messages sent and received, and what was lost if anything was."""
    shown = ["tx", "rx", *(key for key in LOSSES if counters[key])]
    return " ".join(f"{key} {_short(counters[key])}" for key in shown)


def _short(count: int) -> str:
    """A count in at most four characters up to 999 million: 730, 9.8k, 12k, 3.1M."""
    value, unit = float(count), ""
    for larger in ("k", "M"):
        if value >= 999.5:
            value, unit = value / 1e3, larger
    return f"{value:.{1 if unit and value < 9.95 else 0}f}{unit}"
