"""Virtual files of MAVLink FTP: metadata, packed parameters and plans, logs, a look inside.

https://mavlink.io/en/services/ftp.html, "Virtual Directory Entries", for @MAV_LOG. The other names with an @ are
ArduPilot's, /fs/microsd/log and /etc/extras are PX4's, so that tools find things where they look for them.
"""

import errno
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sitl.flight.parameters import Parameters
from sitl.flight.refused import Refused
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.ftp_files import Mount, VirtualFile
from sitl.mavlink.mission import LIMITS
from sitl.mavlink.mission_conversion import MISSION, StoredItem, home_item, item_int_fields, stored
from sitl.mavlink.mission_plans import KINDS, Plans
from sitl.mavlink.packed_files import packed_parameters, packed_plan, unpacked_parameters, unpacked_plan
from sitl.mavlink.service import Exchange

__all__ = ["standard_mounts"]

LOG_FOLDERS = ("/fs/microsd/log", "@MAV_LOG")
# What PX4 ships for its IO processor: examples of its tools download it from every vehicle.
IO_FIRMWARE = "/etc/extras/px4_io-v2_default.bin"
NO_IO_PROCESSOR = b"This vehicle has no IO processor. The file is here for tools that expect one.\n"


def standard_mounts(
    exchange: Exchange,
    plans: Plans | None = None,
    *,
    metadata: Mapping[str, Mount] | None = None,
    logs: Path | None = None,
) -> dict[str, Mount]:
    """All virtual files of a vehicle, by path.

    Args:
        exchange: of the vehicle.
        plans: mission, geofence and rally points.
        metadata: files of component metadata, by path.
        logs: where logs are; the state folder's by default.
    """
    mounts: dict[str, Mount] = {**(metadata or {}), IO_FIRMWARE: NO_IO_PROCESSOR}
    mounts |= dict.fromkeys(LOG_FOLDERS, logs or exchange.state.logs)
    if not exchange.identity.bytewise_parameters:
        # Who finds it takes parameters for ArduPilot's: MAVProxy would send whole numbers as such, not as their bits.
        mounts["@PARAM/param.pck"] = VirtualFile(
            lambda query: packed_parameters(_parameters(exchange), query),
            lambda data: _parameters(exchange).load(unpacked_parameters(data)),
        )
    if plans is not None:
        mounts |= {f"@MISSION/{name}.dat": _plan_file(plans, kind) for kind, name in KINDS.items()}
    mounts["@SYS/uarts.txt"] = lambda _: _links(exchange)
    mounts["@SYS/threads.txt"] = lambda _: _threads()
    return mounts


def _parameters(exchange: Exchange) -> Parameters:
    """The flight's; raises OSError without an autopilot."""
    try:
        return exchange.simulation.flight.parameters
    except Refused as refused:
        raise FileNotFoundError(errno.ENOENT, refused.reason) from None


def _plan_file(plans: Plans, kind: int) -> VirtualFile:
    return VirtualFile(lambda _: packed_plan(kind, _items(plans, kind)), lambda data: _store(plans, kind, data))


def _items(plans: Plans, kind: int) -> list[dict[str, Any]]:
    """Fields of a plan's items as stations number them: from home on where missions begin with it."""
    flight, offset = plans.flight, plans.offset(kind)
    if flight is None:
        raise FileNotFoundError(errno.ENOENT, "the autopilot is off")
    items = plans.plan(kind).items
    if kind == MISSION and offset:
        items = (home_item(*flight.home.geodetic), *(_jumping(item, offset) for item in items))
    return [
        {
            **item_int_fields(item),
            "seq": number,
            "mission_type": kind,
            "current": int(kind == MISSION and number == flight.mission.current + offset),
        }
        for number, item in enumerate(items)
    ]


def _store(plans: Plans, kind: int, data: bytes) -> None:
    """Replace a plan, or part of it, by an upload; raises ValueError with the reason if it is not taken."""
    plan = unpacked_plan(data)
    title, offset = KINDS[kind].capitalize(), plans.offset(kind)
    if plan.kind != kind:
        msg = f"{title} refused: expected items of type {kind}, got {plan.kind}"
        raise ValueError(msg)
    if plan.start + len(plan.items) > LIMITS[kind] + offset:
        msg = f"{title} refused: expected at most {LIMITS[kind]} items, got {plan.start + len(plan.items)}"
        raise ValueError(msg)
    items = [_jumping(stored(item, is_int=True), -offset) for item in plan.items]
    first = max(plan.start - offset, 0)
    items = items[max(offset - plan.start, 0) :]  # home is where it is
    if plan.is_part:
        old = plans.plan(kind).items
        items = [*old[:first], *items, *old[first + len(items) :]]
    problems = plans.store(kind, items)
    if problems:
        problem = problems[0]
        place = "" if problem.index < 0 else f"item {problem.index + offset}: "
        msg = f"{title} refused: {place}{problem.reason}"
        raise ValueError(msg)


def _jumping(item: StoredItem, offset: int) -> StoredItem:
    """An item whose jump, if it is one, leads to where it does when items are numbered from another number on."""
    return item._replace(param1=item.param1 + offset) if item.command == mav.MAV_CMD_DO_JUMP else item


def _links(exchange: Exchange) -> bytes:
    """What has gone over each link."""
    lines = [
        f"{link.spec.text} " + " ".join(f"{name} {count}" for name, count in link.statistics().items())
        for link in exchange.links
    ]
    return "\n".join([*lines, ""]).encode()


def _threads() -> bytes:
    """Threads of the process."""
    return "".join(f"{thread.name}\n" for thread in threading.enumerate()).encode()
