"""Mission protocol: mission, geofence and rally points up and down, cleared, and the current item set.

https://mavlink.io/en/services/mission.html. A plan is replaced as a whole, once it is all here and the flight has taken
it, or not at all. Stations of all ages are served: items as integers or floats, whichever they send or ask for.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from sitl.flight.feasibility import Problem
from sitl.flight.refused import Refused
from sitl.mavlink.command import Command, CommandHandler, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.mission_conversion import FENCE, MISSION, RALLY, StoredItem, mission_item, result_of, stored
from sitl.mavlink.mission_download import Downloads
from sitl.mavlink.mission_guided import ALTITUDE_ITEM, GUIDED_ITEM, fly_item
from sitl.mavlink.mission_plans import KINDS, Plans
from sitl.mavlink.mission_progress import MissionProgress
from sitl.mavlink.mission_upload import GIVES_UP, Upload
from sitl.mavlink.service import Builder, Exchange, Handler, Sender, Service
from sitl.snapshot import Snapshot

__all__ = ["LIMITS", "MissionService"]

LIMITS = {MISSION: 5000, FENCE: 1000, RALLY: 100}  # items of a plan
MOST_TOLD = 5  # problems of one upload that are told as text
KEEP_CURRENT = -1  # as the number of the item to set


class _Ended(NamedTuple):
    """The latest upload of a kind: who sent it, which item was the last one asked for, and what came of it."""

    sender: Sender
    number: int
    result: int
    opaque_id: int


class MissionService(Service):
    """Keeps the plans of the vehicle with its ground stations."""

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`; loads the plans that are stored."""
        super().__init__(exchange)
        self._plans = Plans(exchange)
        self._progress = MissionProgress(exchange, self._plans)
        self._downloads = Downloads(exchange, self._plans)
        self._uploads: dict[int, Upload] = {}
        self._ended: dict[int, _Ended] = {}

    @property
    def plans(self) -> Plans:
        """What is kept, for other ways to bring and take it."""
        return self._plans

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        downloads = self._downloads
        return {
            "MISSION_COUNT": self._on_count,
            "MISSION_ITEM_INT": lambda message, sender: self._on_item(message, sender, is_int=True),
            "MISSION_ITEM": lambda message, sender: self._on_item(message, sender, is_int=False),
            "MISSION_ACK": self._on_ack,
            "MISSION_REQUEST_LIST": downloads.on_request_list,
            "MISSION_REQUEST_INT": lambda message, sender: downloads.on_request(message, sender, is_int=True),
            "MISSION_REQUEST": lambda message, sender: downloads.on_request(message, sender, is_int=False),
            "MISSION_REQUEST_PARTIAL_LIST": downloads.on_request_partial_list,
            "MISSION_WRITE_PARTIAL_LIST": self._on_write_partial_list,
            "MISSION_CLEAR_ALL": self._on_clear_all,
            "MISSION_SET_CURRENT": self._on_set_current,
        }

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {mav.MAV_CMD_DO_SET_MISSION_CURRENT: self._do_set_mission_current}

    def telemetry(self) -> Mapping[str, Builder]:
        """See Service."""
        return {"MISSION_CURRENT": self._progress.mission_current}

    def update(self, snapshot: Snapshot) -> None:
        """See Service."""
        _ = snapshot
        self._progress.update()

    def restarted(self) -> None:
        """See Service: transfers under way are over; plans stay, for the flight keeps them."""
        for kind in KINDS:
            self._stop(kind)
        self._ended.clear()
        self._downloads.restarted()
        self._progress.restarted()

    # -- upload --------------------------------------------------------------------------------------------------------

    def _on_count(self, message: Any, sender: Sender) -> None:
        kind, count = message.mission_type, message.count
        if not self._may_write(sender, kind):
            return
        if count > LIMITS[kind] + self._plans.offset(kind):
            text = f"{_title(kind)} refused: {count} items, expected at most {LIMITS[kind]}"
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, text)
            self._acknowledge(sender, kind, mav.MAV_MISSION_NO_SPACE)
        elif count == 0:
            self._store(sender, kind, 0, ())
        else:
            self._begin(sender, kind, range(count), is_part=False)

    def _on_write_partial_list(self, message: Any, sender: Sender) -> None:
        """Items from one to another are replaced, or added at the end; the others stay."""
        kind, first, last = message.mission_type, message.start_index, message.end_index
        if not self._may_write(sender, kind):
            return
        if not 0 <= first <= min(last, self._plans.count(kind)):
            self._acknowledge(sender, kind, mav.MAV_MISSION_INVALID_SEQUENCE)
        elif last >= LIMITS[kind] + self._plans.offset(kind):
            self._acknowledge(sender, kind, mav.MAV_MISSION_NO_SPACE)
        else:
            self._begin(sender, kind, range(first, last + 1), is_part=True)

    def _may_write(self, sender: Sender, kind: int, *kinds: int) -> bool:
        """Whether a station may change the plan of a kind, or of several at once that `kind` means together.

        If so an upload of its own has ended, else it is told why not.
        """
        kinds = kinds or (kind,)
        busy = [one for one in kinds if one in self._uploads and self._uploads[one].sender != sender]
        if kinds[0] not in KINDS:
            self._acknowledge(sender, kind, mav.MAV_MISSION_UNSUPPORTED)
        elif self._plans.flight is None:
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, "No plan is taken: the autopilot is off")
            self._acknowledge(sender, kind, mav.MAV_MISSION_ERROR)
        elif busy:
            text = f"{_title(busy[0])} denied: station {self._uploads[busy[0]].sender.system} is sending one"
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, text)
            self._acknowledge(sender, kind, mav.MAV_MISSION_DENIED)
        else:
            for one in kinds:
                self._stop(one)
            return True
        return False

    def _begin(self, sender: Sender, kind: int, numbers: range, *, is_part: bool) -> None:
        self._uploads[kind] = Upload(
            self.exchange,
            sender,
            kind,
            numbers,
            offset=self._plans.offset(kind),
            is_part=is_part,
            end=self._upload_ended,
            give_up=self._upload_given_up,
        )
        self._uploads[kind].begin()

    def _on_item(self, message: Any, sender: Sender, *, is_int: bool) -> None:
        kind, number = message.mission_type, message.seq
        if kind == MISSION and message.current in (GUIDED_ITEM, ALTITUDE_ITEM):
            self._fly(sender, stored(message, is_int=is_int), altitude_only=message.current == ALTITUDE_ITEM)
            return
        upload, ended = self._uploads.get(kind), self._ended.get(kind)
        if upload is not None:
            if upload.sender == sender:
                upload.take(number, stored(message, is_int=is_int), is_int=is_int)
            else:
                self._acknowledge(sender, kind, mav.MAV_MISSION_DENIED)
        elif ended is None or ended.sender != sender:
            self._acknowledge(sender, kind, mav.MAV_MISSION_INVALID_SEQUENCE)
        elif number == ended.number:  # the station has not heard what came of its upload
            self._acknowledge(sender, kind, ended.result, ended.opaque_id)

    def _upload_ended(self, upload: Upload, problems: list[Problem]) -> None:
        """All items have come, or one that no plan could hold."""
        kind, number = upload.kind, upload.expected
        self._stop(kind)
        if problems:
            self._refuse(upload.sender, kind, number, problems)
            return
        items = tuple(upload.items)
        if upload.is_part:
            old, numbers = self._plans.plan(kind).items, upload.numbers
            first, end = (max(one - self._plans.offset(kind), 0) for one in (numbers.start, numbers.stop))
            items = (*old[:first], *items, *old[end:])
        self._store(upload.sender, kind, number, items)

    def _upload_given_up(self, upload: Upload) -> None:
        kind, number = upload.kind, upload.expected
        self._stop(kind)
        text = f"{_title(kind)} upload given up: no item {number} within {GIVES_UP:g} s"
        self.exchange.tell(upload.sender, mav.MAV_SEVERITY_WARNING, text)
        self._end(upload.sender, kind, number, mav.MAV_MISSION_OPERATION_CANCELLED)

    def _on_ack(self, message: Any, sender: Sender) -> None:
        """The end of a station's download, or its wish to end its upload."""
        kind = message.mission_type
        self._downloads.ended(sender, kind)
        upload = self._uploads.get(kind)
        if upload is None or upload.sender != sender or message.type == mav.MAV_MISSION_ACCEPTED:
            return
        if message.type == mav.MAV_MISSION_UNSUPPORTED and upload.refused_request():
            return
        self._stop(kind)
        self._end(sender, kind, upload.expected, mav.MAV_MISSION_OPERATION_CANCELLED)

    def _stop(self, kind: int) -> None:
        upload = self._uploads.pop(kind, None)
        if upload is not None:
            upload.stop()

    def _store(self, sender: Sender, kind: int, number: int, items: tuple[StoredItem, ...]) -> None:
        """Take a plan, or none; `number` is that of the item which made it whole."""
        problems = self._plans.store(kind, items)
        if problems:
            self._refuse(sender, kind, number, problems)
        else:
            self._end(sender, kind, number, mav.MAV_MISSION_ACCEPTED, self._plans.plan(kind).id)
            self._progress.update()

    def _refuse(self, sender: Sender, kind: int, number: int, problems: list[Problem]) -> None:
        """Say what is wrong with a plan."""
        for problem in problems[:MOST_TOLD]:
            place = "" if problem.index < 0 else f"item {problem.index + self._plans.offset(kind)}: "
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, f"{_title(kind)} refused: {place}{problem.reason}")
        if len(problems) > MOST_TOLD:
            text = f"{_title(kind)} refused: {len(problems) - MOST_TOLD} more problems"
            self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, text)
        self._end(sender, kind, number, result_of(problems[0]))

    def _end(self, sender: Sender, kind: int, number: int, result: int, opaque_id: int = 0) -> None:
        self._ended[kind] = _Ended(sender, number, result, opaque_id)
        self._acknowledge(sender, kind, result, opaque_id)

    def _acknowledge(self, sender: Sender, kind: int, result: int, opaque_id: int = 0) -> None:
        self.exchange.reply(sender, "MISSION_ACK", type=result, mission_type=kind, opaque_id=opaque_id)

    # -- clearing, guided items, the current item ----------------------------------------------------------------------

    def _on_clear_all(self, message: Any, sender: Sender) -> None:
        kind = message.mission_type
        kinds = tuple(KINDS) if kind == mav.MAV_MISSION_TYPE_ALL else (kind,)
        if not self._may_write(sender, kind, *kinds):
            return
        for one in kinds:
            self._plans.store(one, ())
            self._ended.pop(one, None)
        self._acknowledge(sender, kind, mav.MAV_MISSION_ACCEPTED)
        self._progress.update()

    def _fly(self, sender: Sender, item: StoredItem, *, altitude_only: bool) -> None:
        flight = self._plans.flight
        result = mav.MAV_MISSION_ERROR
        if flight is not None:
            try:
                result = fly_item(flight, mission_item(item), altitude_only=altitude_only)
            except Refused as refused:
                self.exchange.tell(sender, mav.MAV_SEVERITY_WARNING, f"Guided item refused: {refused.reason}")
        self._acknowledge(sender, MISSION, result)

    def _on_set_current(self, message: Any, sender: Sender) -> None:
        """Everybody is told, as the guide says: the item of the mission, or why it is not the one asked for."""
        _ = sender
        self._set_current(message.seq)

    def _do_set_mission_current(self, command: Command) -> int:
        """MAV_CMD_DO_SET_MISSION_CURRENT: item, -1 to keep the present one; 1 lets jumps count their repeats anew."""
        number = whole_number(command.params[0])
        if number is None or number < KEEP_CURRENT:
            msg = f"mission item: expected its number, or -1 to keep the present one, got {command.params[0]:g}"
            raise Refused(msg)
        mission = self.exchange.simulation.flight.mission
        if command.params[1] == 1.0:
            mission.reset_jumps()
        if number == KEEP_CURRENT:
            number = mission.current + self._plans.offset(MISSION)
            if not mission.finished:
                self._progress.tell()
                return mav.MAV_RESULT_ACCEPTED
        return mav.MAV_RESULT_ACCEPTED if self._set_current(number) else mav.MAV_RESULT_FAILED

    def _set_current(self, number: int) -> bool:
        """Go on with an item, as stations number them; home stands for the first one."""
        flight, offset, count = self._plans.flight, self._plans.offset(MISSION), self._plans.count(MISSION)
        if flight is None or not 0 <= number < count:
            expected = f"expected one from 0 to {count - 1}" if count else "no mission"
            self.exchange.statustext(mav.MAV_SEVERITY_WARNING, f"Mission item {number} not set: {expected}")
            return False
        flight.jump_to(max(number - offset, 0))
        self._progress.tell()
        return True


def _title(kind: int) -> str:
    return KINDS[kind].capitalize()
