"""The wire between a client and the vehicle: passes datagrams on, does to them what the faults say, and remembers them.

It has no sockets: `sitl.testing.relay` gives it what has arrived and sends what it returns.
"""

import heapq
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from itertools import count as numbers
from typing import Any, NamedTuple, TypeVar

from sitl.testing.faults import (
    Delay,
    Deny,
    Direction,
    Drop,
    Duplicate,
    Fault,
    Passage,
    Reorder,
    Which,
    split_frames,
)
from sitl.testing.names import command_ids, message_ids, result_number

__all__ = ["Wire"]

MAX_DATAGRAM = 1400  # frames share a datagram up to this size, as the vehicle's do [bytes]
PATIENCE = 0.2  # that a frame held back waits for others to overtake it [s]: the last one of all arrives, too
REMEMBERED = 10_000  # datagrams of each direction
AUTOPILOT = 1  # MAV_COMP_ID_AUTOPILOT1

Messages = int | str | Iterable[int | str]
Kind = TypeVar("Kind", bound=Fault)


class _Held(NamedTuple):
    """A frame that lets others overtake it."""

    after: int  # goes when so many frames have come along in its direction
    until: float  # or at this wall time
    passage: Passage


class _Way:
    """One direction, and the frames that are under way in it."""

    def __init__(self) -> None:
        self.sent: deque[tuple[float, bytes]] = deque(maxlen=REMEMBERED)
        self.frames = 0
        self.held: list[_Held] = []
        self.delayed: list[tuple[float, int, bytes]] = []  # a heap of when, number, frame

    def forget(self) -> None:
        """Lose what is under way."""
        self.held.clear()
        self.delayed.clear()

    def next_due(self) -> float | None:
        """When something arrives that is under way, by wall time."""
        due = [held.until for held in self.held]
        if self.delayed:
            due.append(self.delayed[0][0])
        return min(due, default=None)


class Wire:
    """What a test can do to the datagrams between its client and the vehicle, and see of them.

    Faults add up, each strikes what the earlier ones have left, and each can be removed by itself, ended with a with
    block, or all together with `restore`. All take

        messages: MAVLink messages by name or id, one or several; None for all.
        direction: "to_vehicle", "to_client" or "both".
        share: of those frames, 0 to 1, chosen by counting with a seed.
        count: no more than so many frames, then the fault is over; None for no end.

    and raise ValueError for what they do not know.
    """

    def __init__(self, *, system: int = 1, seed: int = 0) -> None:
        """`system`: the vehicle's id; `seed`: where the choices begin."""
        self.lock = threading.RLock()  # held by whoever changes or uses the wire, until what comes of it is sent
        self._system = system
        self._seed = seed
        self._made = numbers()
        self._numbers = numbers()
        self._answers = 0
        self._faults: tuple[Fault, ...] = ()
        self._ways = {"to_vehicle": _Way(), "to_client": _Way()}

    # -- what a test calls ---------------------------------------------------------------------------------------

    def drop(
        self,
        share: float = 1.0,
        *,
        messages: Messages | None = None,
        direction: Direction = "both",
        count: int | None = None,
    ) -> Fault:
        """Lose frames."""
        return self._add(Drop, Which(share, message_ids(messages), direction, count))

    def duplicate(
        self,
        share: float = 1.0,
        *,
        messages: Messages | None = None,
        direction: Direction = "both",
        count: int | None = None,
    ) -> Fault:
        """Let frames arrive twice."""
        return self._add(Duplicate, Which(share, message_ids(messages), direction, count))

    def reorder(
        self,
        share: float = 1.0,
        *,
        behind: int = 3,
        messages: Messages | None = None,
        direction: Direction = "both",
        count: int | None = None,
    ) -> Fault:
        """Let frames be overtaken by the next `behind` ones of their direction, or as many as come within 0.2 s."""
        return self._add(Reorder, Which(share, message_ids(messages), direction, count), behind=behind)

    def delay(
        self,
        seconds: float,
        jitter: float = 0.0,
        *,
        share: float = 1.0,
        messages: Messages | None = None,
        direction: Direction = "both",
        count: int | None = None,
    ) -> Fault:
        """Let frames take `seconds` of wall time, and up to `jitter` more, by which they may overtake each other."""
        which = Which(share, message_ids(messages), direction, count)
        return self._add(Delay, which, seconds=seconds, jitter=jitter)

    def silence(self, direction: Direction = "both") -> Fault:
        """Let nothing through any more, also of what is under way. Once this returns, nothing more arrives."""
        with self.lock:
            fault = self._add(Drop, Which(1.0, None, direction, None))
            for name, way in self._ways.items():
                if direction in ("both", name):
                    way.forget()
            return fault

    def deny(
        self,
        command: int | str | Iterable[int | str] | None = None,
        result: int | str = "DENIED",
        *,
        share: float = 1.0,
        count: int | None = None,
    ) -> Fault:
        """Answer commands for the vehicle with a COMMAND_ACK of this MAV_RESULT; it never sees them.

        `command`: MAV_CMDs by name or number, one or several; None for all. Names go with or without their prefix.
        """
        which = Which(share, None, "to_vehicle", count)
        number = result_number(result)
        return self._add(Deny, which, system=self._system, commands=command_ids(command), result=number)

    def restore(self) -> None:
        """Mend all faults; what is still under way arrives when it should."""
        with self.lock:
            self._faults = ()

    def messages(self, *names: int | str, direction: Direction = "to_vehicle") -> list[Any]:
        """What was sent in a direction so far, as pymavlink's messages, in order; `names`: only these messages.

        That is what the sender has sent: what is lost here is part of it, what is duplicated counts once. `_timestamp`
        of a message tells when [s since 1970]. At least the last 10 000 datagrams of each direction are remembered.
        """
        if direction not in self._ways:
            msg = f"direction: expected to_vehicle or to_client, got {direction!r}"
            raise ValueError(msg)
        from pymavlink.dialects.v20 import all as dialect

        wanted = message_ids(names) if names else None
        with self.lock:
            sent = list(self._ways[direction].sent)
        reader: Any = dialect.MAVLink(None)
        reader.robust_parsing = True
        found: list[Any] = []
        for moment, data in sent:
            for message, frame in split_frames(data):
                if message in dialect.mavlink_map and (wanted is None or message in wanted):
                    for decoded in reader.parse_buffer(bytearray(frame)) or ():
                        if decoded.get_msgId() == message:
                            decoded._timestamp = moment
                            found.append(decoded)
        return found

    # -- what the relay calls ------------------------------------------------------------------------------------

    def carry(self, data: bytes, now: float, *, to_vehicle: bool) -> list[tuple[bool, bytes]]:
        """Take in a datagram; gives the datagrams to send now, each with whether it goes to the vehicle.

        `now` is monotonic wall time [s].
        """
        way = self._way(to_vehicle)
        way.sent.append((time.time(), data))
        if not self._faults and not way.held:
            way.frames += 1
            return [(to_vehicle, data)]
        arrived: list[bytes] = []
        answers: list[tuple[bool, bytes]] = []
        for message, frame in split_frames(data):
            way.frames += 1
            passage = Passage(message, frame, to_vehicle=to_vehicle)
            self._strike(passage)
            if passage.answer is not None:
                answers += self.carry(self._acknowledgement(passage), now, to_vehicle=False)
            if passage.copies and passage.behind:
                way.held.append(_Held(way.frames + passage.behind, now + PATIENCE, passage))
            else:
                self._let_go(way, passage, now, arrived)
            if way.held:
                self._let_go_overtaken(way, now, arrived)
        return [*((to_vehicle, datagram) for datagram in _packed(arrived)), *answers]

    def due(self, now: float) -> list[tuple[bool, bytes]]:
        """What was under way and arrives by now, as `carry` gives it."""
        out: list[tuple[bool, bytes]] = []
        for to_vehicle in (True, False):
            way = self._way(to_vehicle)
            arrived: list[bytes] = []
            if way.held:
                self._let_go_overtaken(way, now, arrived)
            while way.delayed and way.delayed[0][0] <= now:
                arrived.append(heapq.heappop(way.delayed)[2])
            out += ((to_vehicle, datagram) for datagram in _packed(arrived))
        return out

    def next_due(self) -> float | None:
        """When `due` has something next, by monotonic wall time [s]; None: nothing is under way."""
        return min((due for way in self._ways.values() if (due := way.next_due()) is not None), default=None)

    def forget(self) -> None:
        """Lose what is under way, for one end of the wire is new."""
        with self.lock:
            for way in self._ways.values():
                way.forget()

    # -- inside --------------------------------------------------------------------------------------------------

    def _add(self, kind: Callable[..., Kind], which: Which, **details: Any) -> Kind:
        with self.lock:
            fault = kind(self._take_off, f"{self._seed} {next(self._made)}", which, **details)
            self._faults = tuple(sorted((*self._faults, fault), key=lambda each: each.stage))
            return fault

    def _take_off(self, fault: Fault) -> None:
        with self.lock:
            self._faults = tuple(each for each in self._faults if each is not fault)

    def _way(self, to_vehicle: bool) -> _Way:
        return self._ways["to_vehicle" if to_vehicle else "to_client"]

    def _strike(self, passage: Passage) -> None:
        for fault in self._faults:
            if fault.strikes(passage):
                fault.act(passage)
                if not passage.copies:
                    return

    def _let_go(self, way: _Way, passage: Passage, now: float, arrived: list[bytes]) -> None:
        """Let a frame arrive at once, or after its delay."""
        for _ in range(passage.copies):
            if passage.delay:
                heapq.heappush(way.delayed, (now + passage.delay, next(self._numbers), passage.frame))
            else:
                arrived.append(passage.frame)

    def _let_go_overtaken(self, way: _Way, now: float, arrived: list[bytes]) -> None:
        waiting, way.held = way.held, []
        for held in waiting:
            if held.after <= way.frames or held.until <= now:
                self._let_go(way, held.passage, now, arrived)
            else:
                way.held.append(held)

    def _acknowledgement(self, passage: Passage) -> bytes:
        from pymavlink.dialects.v20 import all as dialect

        assert passage.answer is not None
        writer: Any = dialect.MAVLink(None, srcSystem=self._system, srcComponent=AUTOPILOT)
        writer.seq = self._answers & 0xFF
        self._answers += 1
        message: Any = dialect.MAVLink_command_ack_message(*passage.answer, 0, 0, *passage.sender)
        return bytes(message.pack(writer))


def _packed(frames: list[bytes]) -> list[bytes]:
    """Frames in datagrams, as few as the size allows."""
    datagrams: list[bytes] = []
    for frame in frames:
        if datagrams and len(datagrams[-1]) + len(frame) <= MAX_DATAGRAM:
            datagrams[-1] += frame
        else:
            datagrams.append(frame)
    return datagrams
