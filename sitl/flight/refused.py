"""The one way in which a command to the flight fails."""

__all__ = ["Refused"]


class Refused(Exception):  # noqa: N818 (what happened, not what went wrong)
    """A command that is not carried out.

    `reason` is one line for the pilot. `temporary` says that the same command may be accepted later (on the ground, in
    another mode, once a fault is gone) without being changed.
    """

    def __init__(self, reason: str, temporary: bool = False) -> None:
        super().__init__(reason)
        self.reason = reason
        self.temporary = temporary
