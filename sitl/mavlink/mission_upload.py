"""One upload of a plan: the vehicle asks for item after item, and asks again until each comes or it gives up.

https://mavlink.io/en/services/mission.html, "Upload a Mission to the Vehicle" and "Timeouts and Retries". Some stations
answer MISSION_REQUEST_INT only, some MISSION_REQUEST only: on silence both are tried, until it is clear what works.
"""

from collections.abc import Callable
from typing import Final

from sitl.flight.feasibility import Problem
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.mission_conversion import MISSION, StoredItem, unsupported_item
from sitl.mavlink.service import Exchange, Sender
from sitl.mavlink.timers import Timer

__all__ = ["GIVES_UP", "Upload"]

SILENCE = 0.25  # after which an item is asked for again [s], wall time
LAST_SILENCE = 1.5  # after the last request [s]
RETRIES = 10  # five with each of the two requests, or all with the one that is known to work
GIVES_UP: Final = SILENCE * RETRIES + LAST_SILENCE  # this long after it has first asked for an item [s]


class Upload:
    """Items being sent by one station, numbered as it numbers them.

    Attributes:
        sender: the station.
        kind: MAV_MISSION_TYPE.
        numbers: of the items to come.
        is_part: they take the places of some items of the plan that the vehicle has.
        items: those that have come, in the flight's numbers; without home.
        expected: number of the item asked for.
    """

    def __init__(
        self,
        exchange: Exchange,
        sender: Sender,
        kind: int,
        numbers: range,
        *,
        offset: int,
        is_part: bool,
        end: Callable[["Upload", list[Problem]], None],
        give_up: Callable[["Upload"], None],
    ) -> None:
        """`begin` asks for the first item.

        Args:
            exchange: of the vehicle.
            sender: the station.
            kind: MAV_MISSION_TYPE.
            numbers: of the items to come, at least one.
            offset: number of the item that is the flight's first one; those before it are not kept, whatever they hold.
            is_part: see Attributes.
            end: told that all items have come, or of an item that no plan could hold.
            give_up: told that the station has fallen silent.
        """
        self.sender, self.kind, self.numbers, self.is_part = sender, kind, numbers, is_part
        self.items: list[StoredItem] = []
        self.expected = numbers.start
        self._exchange, self._offset, self._end, self._give_up = exchange, offset, end, give_up
        self._timer: Timer | None = None
        self._retries = 0  # for this item
        self._hurried = False  # this item was asked for again because another one came
        self._asked: set[bool] = set()  # for this item: True with MISSION_REQUEST_INT, False with MISSION_REQUEST
        self._begins_int = True  # which of them is sent first,
        self._block = 1  # so many times before the other one is tried,
        self._proven = False  # unless it is known to work
        self._has_asked_float = False

    def begin(self) -> None:
        """Ask for the first item."""
        self._ask()

    def stop(self) -> None:
        """Ask for nothing any more."""
        if self._timer is not None:
            self._timer.cancel()

    def take(self, number: int, item: StoredItem, *, is_int: bool) -> None:
        """An item has come, in a MISSION_ITEM_INT or a MISSION_ITEM. One out of order is dropped."""
        if number != self.expected:
            # Asked again at once, but once only: over a slow link every copy of an item would be asked for again.
            if not self._hurried:
                self._hurried = True
                self._ask()
            return
        index = number - self._offset
        if index >= 0:
            if self.kind == MISSION and item.command == mav.MAV_CMD_DO_JUMP:
                item = item._replace(param1=item.param1 - self._offset)
            problem = unsupported_item(self.kind, index, item)
            if problem is not None:
                self.stop()
                self._end(self, [problem])
                return
            self.items.append(item)
        if number + 1 == self.numbers.stop:
            self.stop()
            self._end(self, [])
            return
        self._learn(is_int)
        self.expected = number + 1
        self._asked.clear()
        self._retries, self._hurried = 0, False
        self._ask()

    def refused_request(self) -> bool:
        """The station has answered UNSUPPORTED: whether that can mean that it knows MISSION_REQUEST_INT only."""
        if self._has_asked_float and not (self._proven and self._begins_int):
            self._proven = self._begins_int = True
            self._ask()
        return self._has_asked_float

    def _ask(self) -> None:
        self.stop()
        other_turn = not self._proven and self._retries // self._block % 2 == 1
        asks_int = self._begins_int != other_turn
        self._asked.add(asks_int)
        self._has_asked_float |= not asks_int
        name = "MISSION_REQUEST_INT" if asks_int else "MISSION_REQUEST"
        self._exchange.reply(self.sender, name, seq=self.expected, mission_type=self.kind)
        self._timer = self._exchange.after(SILENCE if self._retries < RETRIES else LAST_SILENCE, self._silent)

    def _silent(self) -> None:
        if self._retries == RETRIES:
            self._give_up(self)
        else:
            self._retries += 1
            self._ask()

    def _learn(self, is_int: bool) -> None:
        """Choose the request with which to begin the next item.

        Where only one was sent, that is the one. Where both were, the link may be slower than the silence after which
        the other one is tried: then each gets more time in turn, first the one of the same kind as the item.
        """
        if self._proven:
            return
        if len(self._asked) == 1:
            (self._begins_int,) = self._asked
            self._proven = True
        else:
            self._begins_int = is_int if self._block == 1 else not self._begins_int
            self._block *= 2
