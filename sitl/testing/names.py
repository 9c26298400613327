"""MAVLink's names for numbers, as a test writes them; the numbers are pymavlink's."""

from collections.abc import Iterable

__all__ = ["command_ids", "message_ids", "result_number"]

Named = int | str


def message_ids(messages: Named | Iterable[Named] | None) -> frozenset[int] | None:
    """Ids of messages given by name or number, one or several; None stays None. Raises ValueError."""
    return _numbers("message", "MAVLINK_MSG_ID_", messages)


def command_ids(commands: Named | Iterable[Named] | None) -> frozenset[int] | None:
    """Numbers of MAV_CMDs given by name (with or without MAV_CMD_) or number; None stays None. Raises ValueError."""
    return _numbers("command", "MAV_CMD_", commands)


def result_number(result: Named) -> int:
    """Number of a MAV_RESULT given by name (with or without MAV_RESULT_) or number. Raises ValueError."""
    return _number("result", "MAV_RESULT_", result)


def _numbers(kind: str, prefix: str, given: Named | Iterable[Named] | None) -> frozenset[int] | None:
    if given is None:
        return None
    each = (given,) if isinstance(given, int | str) else given
    return frozenset(_number(kind, prefix, one) for one in each)


def _number(kind: str, prefix: str, given: Named) -> int:
    if isinstance(given, int):
        return given
    # The dialect with the most names; nobody should pay for loading it who names nothing.
    from pymavlink.dialects.v20 import all as dialect

    number = getattr(dialect, prefix + given.upper().removeprefix(prefix), None)
    if not isinstance(number, int):
        msg = f"{kind}: expected a name that pymavlink knows, or a number, got {given!r}"
        raise ValueError(msg)  # noqa: TRY004  (its value is wrong, not its type)
    return number
