"""The vehicle's flight logs: one ULog file for each time it is armed, from a little before to a little after.

What they hold is `topics`' affair, where they lie `folder`'s. Rows come at simulated time and cost a few microseconds
each, so that a flight at hundreds of times real time can be logged too; `writer` brings them to the disk. Whatever
happens there, the flight goes on.
"""

import platform
import sys
import time
from collections import deque
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.flight.messages import Message, Severity
from sitl.flight.refused import Refused
from sitl.flight_log.folder import LogFolder
from sitl.flight_log.moment import fill_row
from sitl.flight_log.status import StatusNotes
from sitl.flight_log.topics import DEFINITIONS, SUBSCRIPTIONS, Row
from sitl.flight_log.ulog import default_parameter, dropout, file_header, information, logged_string, parameter
from sitl.flight_log.writer import LogWriter

if TYPE_CHECKING:
    from sitl.flight.flight import Flight
    from sitl.simulation import Simulation

__all__ = ["MOST_BYTES", "RATES", "FlightLog", "Sink", "rate_for"]

RATES = (10, 25, 50)  # of rows [Hz], simulated time
SLOW_ROWS = 10  # from one row with the slow topics to the next
BEFORE, AFTER = 2.0, 2.0  # that a log holds from before arming and after disarming [s], simulated time
MOST_RECENT = 400  # rows and texts kept for the time before arming: texts may come while time stands still
MOST_BYTES = 64 << 20  # of one file; a longer flight goes on in the next
PIECE = 64 << 10  # given to the disk at once [bytes]
FAST = 10.0  # times real time, beyond which rows are fewer
NEVER = sys.maxsize  # [ticks]

Sink = Callable[[bytes], None]  # takes whole messages of the log, as they come


def rate_for(speed: float) -> int:
    """Rows per simulated second [Hz] that are worth their time at a speed in multiples of real time."""
    return RATES[-1] if speed <= FAST else RATES[0]


class FlightLog:
    """Logs the flights of a simulation; it is one of its watchers from the beginning to `close`.

    Args:
        simulation: the vehicle.
        folder: where logs go; made when it is needed.
        rate: rows per simulated second [Hz], one of RATES.
        unix_epoch: UTC at simulated time zero [s since 1970]; the present if None.
        system: the vehicle's MAVLink id.

    Attributes:
        folder: the logs there are.
        system: as given; may be changed.
        dropped: pieces of logs, of 64 kB, for which the disk was too slow.

    Raises ValueError for another rate.
    """

    def __init__(
        self,
        simulation: "Simulation",
        folder: Path,
        *,
        rate: int = RATES[0],
        unix_epoch: float | None = None,
        system: int = 1,
    ) -> None:
        if rate not in RATES:
            msg = f"log rate: expected one of {', '.join(map(str, RATES))} Hz, got {rate}"
            raise ValueError(msg)
        self.folder = LogFolder(folder)
        self.dropped = 0
        self._simulation = simulation
        self._unix_epoch = time.time() if unix_epoch is None else unix_epoch
        self.system = system
        self._about = _about_us()
        self._writer = LogWriter()
        self._has_failed = False
        self._sinks: list[Sink] = []
        self._row = Row()
        self._row.moment["utc_at_start"] = max(round(self._unix_epoch * 1e6), 0)
        self._row_ticks = simulation.rate // rate
        self._slow_ticks = SLOW_ROWS * self._row_ticks
        self._before_ticks, self._after_ticks = round(BEFORE * simulation.rate), round(AFTER * simulation.rate)
        self._recent: deque[tuple[int, bytes]] = deque(maxlen=MOST_RECENT)  # with their ticks, while no file is open
        self._buffer = bytearray()  # of the open file, not yet given to the disk
        self._is_open = False
        self._size = 0  # of the open file [bytes], what is in the buffer not counted
        self._end = NEVER  # when the log ends [ticks]
        self._gap: int | None = None  # since when pieces were dropped [ticks]
        self._piece_begin = 0  # when the piece in the buffer began [ticks]
        self._begin_flight()
        self._load()
        simulation.watchers.append(self.update)

    @property
    def armed(self) -> bool:
        """Whether the motors may turn: the vehicle's own, or as an outside controller has it."""
        return self._turning if self._flight is None or self._airframe.controls_from_outside else self._flight.armed

    def update(self) -> None:
        """Log the present moment if a row is due."""
        airframe = self._simulation.airframe
        if airframe is not self._airframe:
            self._begin_flight()
        if airframe.tick >= self._next_row:
            self._log(airframe.tick)

    def text(self, severity: int, text: str) -> None:
        """Log what the pilot is told (severity as MAV_SEVERITY); told twice at the same moment, it is logged once."""
        tick = self._airframe.tick
        if (tick, text) != self._latest_text:
            self._latest_text = (tick, text)
            level = min(max(severity, Severity.EMERGENCY), Severity.DEBUG)
            self._add(tick, logged_string(level, self._time_us(tick), text))

    def follow(self, sink: Sink) -> bytes:
        """Let `sink` have everything that is logged from now on, in flight or not; returns what goes before it."""
        definitions = self._definitions(self._airframe.tick)
        self._sinks.append(sink)
        self._next_slow = 0
        return definitions

    def leave(self, sink: Sink) -> None:
        """Let a sink have no more."""
        if sink in self._sinks:
            self._sinks.remove(sink)

    def flush(self) -> None:
        """Give all there is of the open file to the disk, which takes it soon."""
        if not self._buffer:
            return
        tick = self._airframe.tick
        if self._gap is not None:
            self._buffer[:0] = dropout(round((tick - self._gap) / self._simulation.rate * 1e3))
        if self._writer.write(bytes(self._buffer)):
            self._size += len(self._buffer)
            self._gap = None
        else:
            self.dropped += 1
            self._gap = self._piece_begin if self._gap is None else self._gap
        self._buffer.clear()
        self._piece_begin = tick

    def erase(self) -> None:
        """Delete all logs, and log again if that had ended. Raises Refused while armed, or with why it failed."""
        if self.armed:
            msg = "logs are not erased while armed"
            raise Refused(msg, temporary=True)
        self._finish()
        self._writer.close()
        self._writer, self._has_failed = LogWriter(), False
        try:
            self.folder.erase()
        except OSError as error:
            msg = f"logs not erased: {error.strerror or error}"
            raise Refused(msg) from None

    def close(self) -> None:
        """Complete the log and follow the simulation no more."""
        if self.update in self._simulation.watchers:
            self._simulation.watchers.remove(self.update)
        self._finish()
        self._writer.close()

    # -- inside ----------------------------------------------------------------------------------------------------

    def _load(self) -> None:
        """Load the compiled code, which takes too long for a flight."""
        airframe = self._airframe
        fill_row(airframe.craft, airframe.setpoint, self._row.record, 0, airframe.tick, airframe.rate, False, False)

    def _begin_flight(self) -> None:
        """The vehicle has begun anew, or we have."""
        self._finish()
        self._recent.clear()
        self._airframe = self._simulation.airframe
        self._notes = StatusNotes(self._row.moment, self._airframe)
        self._turning = self._touching = False
        self._next_row = self._next_slow = 0
        self._latest_text = (-1, "")
        self._flight: Flight | None = None
        if self._simulation.autopilot:
            self._flight = flight = self._simulation.flight
            flight.messages.listeners.append(self._take_message)
            flight.parameters.on_change.append(self._take_parameter)

    def _log(self, tick: int) -> None:
        """Log the present moment, and see whether a log begins or ends."""
        airframe, row = self._airframe, self._row
        flight = None if airframe.controls_from_outside else self._flight
        self._next_row = tick - tick % self._row_ticks + self._row_ticks
        full = tick >= self._next_slow
        if flight is None:
            full |= self._notes.note_outside(self._turning, self._touching, tick)
        else:
            full |= self._notes.note_flight(flight, tick)
        if full:
            self._next_slow = tick - tick % self._slow_ticks + self._slow_ticks
            self._look_around(flight)
        text = row.full if full else row.quick
        self._turning = fill_row(
            airframe.craft, airframe.setpoint, row.record, len(text), tick, airframe.rate,
            flight is not None, self._flight is not None,
        )  # fmt: skip
        if self._is_open and not self._sinks:  # as good as always: no detour
            self._buffer += text
            if len(self._buffer) >= PIECE:
                self._finish_piece()
        else:
            self._add(tick, bytes(text))
        armed = self._turning if flight is None else flight.armed
        if not armed or not self._is_open or self._end != NEVER:
            self._begin_or_end(tick, armed)

    def _begin_or_end(self, tick: int, armed: bool) -> None:
        """Begin a file once armed, and end it some time after disarming."""
        if armed:
            self._end = NEVER
            if not (self._is_open or self._has_failed):
                self._begin_file()
        elif self._end == NEVER:
            self._end = tick + self._after_ticks
        elif tick >= self._end:
            self._finish()

    def _look_around(self, flight: "Flight | None") -> None:
        """What need not be seen at once. `flight`: if it flies."""
        self._row.moment["system"] = self.system
        if flight is None:
            self._touching = bool(self._airframe.craft["outputs"]["contact_force_body"][0, 0, :, 2].any())
        else:
            reached = self._simulation.items_reached
            self._notes.note_details(flight, reached[-1] if reached else None)
        if self._writer.failure is not None and not self._has_failed:
            self._has_failed = True
            self._is_open = False
            self._buffer.clear()
            self._simulation.say(Severity.WARNING, f"Logging ended: {self._writer.failure}")

    def _add(self, tick: int, data: bytes) -> None:
        """Let everybody have one or more messages."""
        for sink in self._sinks:
            sink(data)
        if self._is_open:
            self._buffer += data
            if len(self._buffer) >= PIECE:
                self._finish_piece()
        else:
            self._recent.append((tick, data))
            while self._recent[0][0] < tick - self._before_ticks:
                self._recent.popleft()

    def _finish_piece(self) -> None:
        """Give it to the disk; the file is complete when it has no room for two more."""
        self.flush()
        if self._size + 2 * PIECE > MOST_BYTES:
            self._finish()

    def _begin_file(self) -> None:
        """Begin a log with what happened just before; nothing where it goes on from a full one."""
        begin = self._recent[0][0] if self._recent else self._airframe.tick
        path = self.folder.next_path(self._unix_epoch + begin / self._simulation.rate)
        self._writer.begin(path, lambda: self.folder.make_room(MOST_BYTES))
        self._is_open = True
        self._size, self._gap, self._piece_begin = 0, None, begin
        self._buffer += self._definitions(begin) + b"".join(data for _, data in self._recent)
        self._recent.clear()
        self.flush()

    def _finish(self) -> None:
        """The log is complete, if there is one."""
        if self._is_open:
            self.flush()
            self._writer.end()
            self._is_open = False
            self._next_slow = 0  # should another log follow at once, its first row is a full one

    def _definitions(self, tick: int) -> bytes:
        """What comes before the first row of a log that begins at a tick."""
        simulation = self._simulation
        about = self._about | {"aircraft": simulation.aircraft.source_file.stem, "start": simulation.description}
        parts = [file_header(self._time_us(tick)), DEFINITIONS]
        parts += [information(key, value) for key, value in about.items()]
        if self._flight is not None:
            parameters = self._flight.parameters
            for name in parameters.names():
                value, default = parameters[name], parameters.definition(name).default
                parts.append(parameter(name, value))
                if value != default:
                    parts.append(default_parameter(name, type(value)(default)))
        return b"".join((*parts, SUBSCRIPTIONS))

    def _time_us(self, tick: int) -> int:
        return round(tick / self._airframe.rate * 1e6)

    def _take_message(self, message: Message) -> None:
        self.text(message.severity, message.text)

    def _take_parameter(self, name: str) -> None:
        if self._flight is not None:
            self._add(self._airframe.tick, parameter(name, self._flight.parameters[name]))


def _about_us() -> dict[str, str | int]:
    """Keys of ULog's information messages."""
    try:
        own_version = version("tiltwing-sitl")
    except PackageNotFoundError:  # run from sources that were never installed
        own_version = "0.0.0"
    return {
        "sys_name": "tiltwing-sitl",
        "ver_hw": "SITL",
        "ver_sw": own_version,
        "sys_os_name": platform.system(),
        "sys_os_ver": platform.release(),
        "sys_toolchain": platform.python_implementation(),
        "sys_toolchain_ver": platform.python_version(),
        "time_ref_utc": 0,  # time zone: UTC
    }
