"""Why a ground program ends without having done what it was asked for, each with the exit code that tells it."""

from enum import IntEnum

__all__ = ["ExitCode", "GroundError", "LinkLostError", "RefusedError", "UnansweredError", "UnfinishedError"]


class ExitCode(IntEnum):
    """Exit codes of all ground programs."""

    DONE = 0
    DIFFERS = 1  # a comparison found differences
    WRONG_INPUT = 2  # an option or a file cannot be used
    REFUSED = 3  # the vehicle said no
    LINK_LOST = 4  # no vehicle, or none any more
    TIMEOUT = 5  # the vehicle is there, but did not answer or finish in time
    UNFINISHED = 6  # the flight ended otherwise than planned
    INTERRUPTED = 130  # Ctrl-C, as shells count it


class GroundError(RuntimeError):
    """What was asked for cannot be done; the text is one line for the user."""

    exit_code = ExitCode.WRONG_INPUT


class RefusedError(GroundError):
    """The vehicle refused."""

    exit_code = ExitCode.REFUSED


class LinkLostError(GroundError):
    """There is no vehicle on the link, or it has fallen silent."""

    exit_code = ExitCode.LINK_LOST


class UnansweredError(GroundError):
    """The vehicle is there but did not answer, or did not finish, in time."""

    exit_code = ExitCode.TIMEOUT


class UnfinishedError(GroundError):
    """The flight ended otherwise than planned."""

    exit_code = ExitCode.UNFINISHED
