"""The flight modes, with the meanings pilots know from other flight controllers."""

from enum import IntEnum

__all__ = ["Mode"]


class Mode(IntEnum):
    """What flies the vehicle: who asks for what."""

    MANUAL = 0  # sticks to surfaces, tilt and throttles
    STABILIZED = 1  # sticks to attitude and thrust
    ALTITUDE = 2  # sticks to motion through the air, or bank; height held
    POSITION = 3  # sticks to velocity, or bank and airspeed; position or track held
    HOLD = 4  # hovers at a point or circles around it, by regime
    TAKEOFF = 5
    LAND = 6
    RETURN = 7
    MISSION = 8
    OFFBOARD = 9  # setpoints from a computer outside
    ORBIT = 10
    TERMINATION = 11  # motors off for good

    @property
    def title(self) -> str:
        """The mode's name as a pilot reads it."""
        return self.name.capitalize()

    @property
    def by_sticks(self) -> bool:
        """Whether a pilot's sticks fly."""
        return self <= Mode.POSITION
