"""Flies a plan with a vehicle: uploads it, arms, starts it and follows it to its end."""

import time
from collections.abc import Callable, Iterator
from typing import Any

from pymavlink.dialects.v20 import all as mav

from gcs_scripts.autopilot import (
    Modes,
    arms_in_guided,
    is_ardupilot,
    set_ardupilot_mode,
    set_mission_mode,
)  # fmt: skip
from gcs_scripts.connection import Vehicle, enum_name
from gcs_scripts.errors import GroundError, LinkLostError, RefusedError, UnansweredError, UnfinishedError
from gcs_scripts.mission_upload import upload
from gcs_scripts.plan_file import Plan, wire_items
from gcs_scripts.vehicle_state import VehicleState
from gcs_scripts.wishes import Wishes

__all__ = ["MissionFlight"]

WISHES = {"SYS_STATUS": 1.0, "MISSION_CURRENT": 0.5, "EXTENDED_SYS_STATE": 0.5}  # intervals [s]
TRY_AGAIN = 1.0  # [s] between attempts while the vehicle is not ready
SETTLE = 3.0  # [s] in which a vehicle may refuse what it has just been sent the mission for
DISARM_WAIT = 3.0  # [s] after arming in which a HEARTBEAT may still be from before
STEP = 0.25  # [s]
ACCEPTED = mav.MAV_RESULT_ACCEPTED


class MissionFlight:
    """One flight of a plan.

    Attributes:
        state: what the vehicle tells.
        item: index in the plan of the item being flown.
        total: how many items the plan has.
        has_landed: whether the vehicle has landed and disarmed after the flight.
    """

    def __init__(self, vehicle: Vehicle, plan: Plan, say: Callable[[str], None]) -> None:
        """`say` takes what happens, line by line. Raises UnansweredError if the vehicle does not tell its modes."""
        self.vehicle, self.plan = vehicle, plan
        self.modes = Modes()
        self.modes.learn(vehicle)
        self.state = VehicleState(vehicle, self.modes)
        self.item, self.total = 0, len(plan.mission)
        self.has_landed = False
        self._furthest = 0
        self._say = say
        self._texts_told = vehicle.texts.count
        self._wishes = Wishes(vehicle, self.state, WISHES, grace=0.0)
        self._has_home = is_ardupilot(vehicle.heartbeat)
        vehicle.on_message.append(self._take)

    def upload(self, progress: Callable[[str, int, int], None]) -> None:
        """Send geofence, rally points and mission; `progress` is told the list, the items sent and all items of it.

        Lists that the plan does not have are cleared. Raises RefusedError, UnansweredError, LinkLostError.
        """
        lists = (  # the mission last: it is checked against the fence
            ("the geofence", mav.MAV_MISSION_TYPE_FENCE, self.plan.fence),
            ("the rally points", mav.MAV_MISSION_TYPE_RALLY, self.plan.rally),
            ("the mission", mav.MAV_MISSION_TYPE_MISSION, self.plan.mission),
        )
        for name, mission_type, items in lists:
            is_mission = mission_type == mav.MAV_MISSION_TYPE_MISSION
            wire = wire_items(items, mission_type, self.plan.home if is_mission and self._has_home else None)
            try:
                upload(self.vehicle, wire, mission_type, name, lambda n, name=name, of=len(wire): progress(name, n, of))
            except RefusedError:
                if items:
                    raise
                continue  # nothing to send, and the vehicle has no such list
            if items:
                self._say(f"{name.removeprefix('the ')} sent: {len(items)} {'item' if len(items) == 1 else 'items'}")

    def start(self, ready_within: float) -> None:
        """Choose the mission's mode and arm; a vehicle in flight goes over to the mission.

        While the vehicle says that it is not ready to arm, it is asked again for up to `ready_within` seconds. Raises
        RefusedError, UnansweredError, LinkLostError.
        """
        vehicle = self.vehicle
        self.item = self._furthest = 0  # what was told of an older mission does not count
        if vehicle.armed:
            self._begin_anew()
            set_mission_mode(vehicle, self.modes)
        else:
            end = time.monotonic() + ready_within
            if arms_in_guided(vehicle.heartbeat):
                self._insist(lambda: set_ardupilot_mode(vehicle, "GUIDED"), end)
                self._insist(self._arm, end)
                set_mission_mode(vehicle, self.modes)
                vehicle.command(mav.MAV_CMD_MISSION_START, name="to start the mission")
            else:
                self._insist(lambda: set_mission_mode(vehicle, self.modes), end)
                self._insist(self._arm, end)
        self._say("the mission is being flown")

    def _begin_anew(self) -> None:
        """Make the first item current, also where the command for it is not known."""
        vehicle, first = self.vehicle, int(self._has_home)
        if vehicle.try_command(mav.MAV_CMD_DO_SET_MISSION_CURRENT, first, name="which item to begin with") != ACCEPTED:
            vehicle.send.mission_set_current_send(vehicle.system, vehicle.component, first)

    def _arm(self) -> None:
        self.vehicle.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, name="to arm")
        self._say("armed")

    def _insist(self, action: Callable[[], None], end: float) -> None:
        """Try again what is refused while the vehicle says that it is not ready yet."""
        settled = time.monotonic() + SETTLE
        told = ""
        while True:
            self._wishes.update(time.monotonic())
            try:
                action()
            except RefusedError as error:
                now = time.monotonic()
                if now >= end or (now >= settled and self._is_ready()):
                    raise
                if str(error) != told:
                    told = str(error)
                    self._say(f"waiting: {error}")
                self.vehicle.listen(TRY_AGAIN)
            else:
                return

    def _is_ready(self) -> bool:
        """Whether the vehicle does not say that its checks before arming fail."""
        status, bit = self.state.get("SYS_STATUS"), mav.MAV_SYS_STATUS_PREARM_CHECK
        if status is None or not status.onboard_control_sensors_present & bit:
            return True
        return bool(status.onboard_control_sensors_health & bit)

    def follow(self, within: float, *, to_landing: bool) -> Iterator[None]:
        """Follow the flight until it is over; gives a moment now and then to show how far it is.

        With `to_landing` it is over when the vehicle has landed and disarmed, else when its last item is done. Raises
        UnfinishedError when it ends before that, UnansweredError when it takes longer than `within` seconds,
        LinkLostError.
        """
        begin = time.monotonic()
        was_armed = in_mission = False
        landing = self.plan.landing if to_landing else None
        goal = self.total - 1 if landing is None else landing
        mode = self.modes.name(self.vehicle.heartbeat)
        while True:
            self._advance()
            now = time.monotonic()
            heartbeat = self.vehicle.heartbeat
            was_armed = was_armed or self.vehicle.armed
            in_mission = in_mission or self.modes.is_mission(heartbeat)
            if self.modes.name(heartbeat) != mode:
                mode = self.modes.name(heartbeat)
                self._say(f"mode {mode}")
            is_at_goal = self._furthest >= goal
            is_disarmed = not self.vehicle.armed and self.vehicle.heard > begin
            if is_disarmed and (was_armed or is_at_goal or now - begin > DISARM_WAIT):
                self._check_landing(goal, is_at_goal=is_at_goal)
                self.has_landed = True
                return
            if not to_landing and is_at_goal and self._is_finished(heartbeat, in_mission=in_mission):
                return
            if now - begin > within:
                raise UnansweredError(f"the flight is not over after {within:g} s: {self.where()}; it goes on")
            yield

    def where(self) -> str:
        """How far the flight is, in words."""
        return f"at item {self.item + 1} of {self.total} in {self.modes.name(self.vehicle.heartbeat)}"

    def _advance(self) -> None:
        self._wishes.update(time.monotonic())
        item = self.item
        self.vehicle.receive(("HEARTBEAT", "MISSION_CURRENT", "MISSION_ITEM_REACHED"), STEP)
        if self.item != item:
            command = enum_name("MAV_CMD", self.plan.mission[self.item].command)
            self._say(f"item {self.item + 1} of {self.total}: {command}")
        for text in self.vehicle.texts.since(self._texts_told):
            self._say(f"vehicle: {enum_name('MAV_SEVERITY', text.severity).lower()}: {text.text}")
        self._texts_told = self.vehicle.texts.count
        try:
            self.vehicle.check_alive()
        except LinkLostError as error:
            raise LinkLostError(f"{error}; it was {self.where()} and flies on by itself") from None

    def _check_landing(self, goal: int, *, is_at_goal: bool) -> None:
        if not is_at_goal:
            raise UnfinishedError(
                f"system {self.vehicle.system} has disarmed {self.where()}, before item {goal + 1} was reached"
            )
        airborne = (mav.MAV_LANDED_STATE_IN_AIR, mav.MAV_LANDED_STATE_TAKEOFF, mav.MAV_LANDED_STATE_LANDING)
        end = time.monotonic() + DISARM_WAIT
        while (extended := self.state.get("EXTENDED_SYS_STATE")) is not None and extended.landed_state in airborne:
            if time.monotonic() > end:
                raise UnfinishedError(f"system {self.vehicle.system} has disarmed in the air, {self.where()}")
            self.vehicle.receive("EXTENDED_SYS_STATE", STEP)

    def _is_finished(self, heartbeat: Any, *, in_mission: bool) -> bool:
        """Whether the last item is done: the vehicle says so, or has gone over to another mode by itself."""
        current, reached = self.state.get("MISSION_CURRENT"), self.state.get("MISSION_ITEM_REACHED")
        if current is not None and current.mission_state == mav.MISSION_STATE_COMPLETE:
            return True
        if reached is not None and reached.seq - self._has_home >= self.total - 1:
            return True
        return in_mission and not self.modes.is_mission(heartbeat)

    def _take(self, message: Any) -> None:
        self.state.add(message, time.monotonic())
        vehicle = self.vehicle
        if (message.get_srcSystem(), message.get_srcComponent()) != (vehicle.system, vehicle.component):
            return
        if message.get_type() in ("MISSION_CURRENT", "MISSION_ITEM_REACHED"):
            index = message.seq - self._has_home
            if 0 <= index < self.total:
                self._furthest = max(self._furthest, index)
                if message.get_type() == "MISSION_CURRENT":
                    self.item = index


def check(plan: Plan, *, to_landing: bool) -> None:
    """Raise GroundError for a plan with nothing to fly, or without a landing where one is waited for."""
    if not plan.mission:
        raise GroundError("the plan has no mission items")
    if to_landing and plan.landing is None:
        raise GroundError(
            "the plan has neither a landing nor a return, so the vehicle would stay in the air: add one, or use"
            " --until finished"
        )
