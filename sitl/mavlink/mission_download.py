"""Downloads of plans: the station asks for the count and then for the items, as integers or as floats.

https://mavlink.io/en/services/mission.html, "Download a Mission from the Vehicle".
"""

from typing import Any, NamedTuple

from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.mission_conversion import MISSION, home_item, item_fields, item_int_fields
from sitl.mavlink.mission_plans import KINDS, Plan, Plans
from sitl.mavlink.service import Exchange, Sender

__all__ = ["Downloads"]

KEPT = 10.0  # a station gets the plan that it was told the count of for so long after its last request [s], wall time
MOST = 64  # stations and plans
BURST, BURST_PERIOD = 20, 0.01  # items sent unasked at a time, and how often [s], wall time


class _Download(NamedTuple):
    """A plan as it was when a station asked for its count, and when the station last asked for anything [s]."""

    plan: Plan
    time: float


class Downloads:
    """Answers requests; each station has its own download, and may have several."""

    def __init__(self, exchange: Exchange, plans: Plans) -> None:
        self._exchange, self._plans = exchange, plans
        self._begun: dict[tuple[Sender, int], _Download] = {}

    def restarted(self) -> None:
        """The vehicle has begun anew."""
        self._begun.clear()

    def ended(self, sender: Sender, kind: int) -> None:
        """A station has all it wants of a plan."""
        self._begun.pop((sender, kind), None)

    def on_request_list(self, message: Any, sender: Sender) -> None:
        """MISSION_REQUEST_LIST."""
        kind = message.mission_type
        if kind not in KINDS:
            self._refuse(sender, kind, mav.MAV_MISSION_UNSUPPORTED)
            return
        plan = self._plans.plan(kind)
        self._keep(sender, kind, plan)
        count = self._plans.count(kind)
        self._exchange.reply(sender, "MISSION_COUNT", count=count, mission_type=kind, opaque_id=plan.id)

    def on_request(self, message: Any, sender: Sender, *, is_int: bool) -> None:
        """MISSION_REQUEST_INT, or MISSION_REQUEST."""
        kind = message.mission_type
        if kind not in KINDS:
            self._refuse(sender, kind, mav.MAV_MISSION_UNSUPPORTED)
            return
        begun = self._begun.get((sender, kind))
        if begun is not None and self._exchange.wall_time - begun.time < KEPT:
            plan = begun.plan
            self._keep(sender, kind, plan)
        else:
            plan = self._plans.plan(kind)
        if not self._send_item(sender, kind, plan, message.seq, is_int=is_int):
            self._refuse(sender, kind, mav.MAV_MISSION_INVALID_SEQUENCE)

    def on_request_partial_list(self, message: Any, sender: Sender) -> None:
        """MISSION_REQUEST_PARTIAL_LIST: items from one to another, or to the last one (-1), are sent unasked."""
        kind, first, last = message.mission_type, message.start_index, message.end_index
        if kind not in KINDS:
            self._refuse(sender, kind, mav.MAV_MISSION_UNSUPPORTED)
            return
        end = self._plans.count(kind)
        last = end - 1 if last == -1 else last
        if 0 <= first <= last < end:
            self._send_part(sender, kind, self._plans.plan(kind), range(first, last + 1))
        else:
            self._refuse(sender, kind, mav.MAV_MISSION_INVALID_SEQUENCE)

    def _keep(self, sender: Sender, kind: int, plan: Plan) -> None:
        """Let a station have all of a plan as it is now, whatever happens to the plan meanwhile."""
        self._begun.pop((sender, kind), None)
        if len(self._begun) == MOST:
            del self._begun[next(iter(self._begun))]  # the one that was silent for longest
        self._begun[sender, kind] = _Download(plan, self._exchange.wall_time)

    def _send_item(self, sender: Sender, kind: int, plan: Plan, number: int, *, is_int: bool) -> bool:
        """Send an item of a plan, as stations number them; False if there is none.

        Home is there without a mission, too: that is where some clients learn it.
        """
        flight, offset = self._plans.flight, self._plans.offset(kind)
        index = number - offset
        if flight is None or index >= len(plan.items):
            return False
        if index < 0:
            item = home_item(*flight.home.geodetic)
        else:
            item = plan.items[index]
            if kind == MISSION and item.command == mav.MAV_CMD_DO_JUMP:
                item = item._replace(param1=item.param1 + offset)
        self._exchange.reply(
            sender,
            "MISSION_ITEM_INT" if is_int else "MISSION_ITEM",
            seq=number,
            current=int(kind == MISSION and index == flight.mission.current),
            mission_type=kind,
            **(item_int_fields(item) if is_int else item_fields(item)),
        )
        return True

    def _send_part(self, sender: Sender, kind: int, plan: Plan, numbers: range) -> None:
        for number in numbers[:BURST]:
            self._send_item(sender, kind, plan, number, is_int=True)
        if len(numbers) > BURST:
            self._exchange.after(BURST_PERIOD, lambda: self._send_part(sender, kind, plan, numbers[BURST:]))

    def _refuse(self, sender: Sender, kind: int, result: int) -> None:
        self._exchange.reply(sender, "MISSION_ACK", type=result, mission_type=kind)
