"""A scenario's steps carried out: each at its time, or after its event, in simulated time.

A step with a time happens at it, whatever else does. Any other step waits until the one before it in the file has been
carried out, then for its event, then for so many seconds more. A step that the flight refuses is said and over with.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sitl.flight.refused import Refused
from sitl.scenario.stage import Action, Stage, Trigger, Watch

__all__ = ["Script", "Step"]

WARNING = 4  # of MAV_SEVERITY


@dataclass(frozen=True)
class Step:
    """What to do and when: `at` a simulated time [s], or `after` so many seconds [s] from a trigger's event."""

    text: str
    action: Action
    at: float | None = None
    trigger: Trigger | None = None
    after: float = 0.0


class Script:
    """The steps of one flight on their stage; begins at simulated time zero."""

    def __init__(self, steps: Sequence[Step], stage: Stage) -> None:
        self._stage = stage
        self._pending = list(enumerate(steps))
        self._done = [False] * len(steps)
        self._watch: dict[int, Watch] = {}
        self._event_time: dict[int, float] = {}

    @property
    def finished(self) -> bool:
        """Whether every step has been carried out."""
        return not self._pending

    def update(self, time: float) -> None:
        """Carry out what is due at this simulated time [s], in the order of the file; called at 50 Hz."""
        if not self._pending:
            return
        for index, step in self._pending:
            try:
                if not self._is_due(index, step, time):
                    continue
                self._done[index] = True
                step.action(self._stage)
            except (Refused, ValueError) as refusal:
                self._done[index] = True
                self._stage.say(WARNING, f"Scenario: {step.text!r} refused: {refusal}")
        self._pending = [(index, step) for index, step in self._pending if not self._done[index]]

    def _is_due(self, index: int, step: Step, time: float) -> bool:
        if step.at is not None:
            return time >= step.at
        if index > 0 and not self._done[index - 1]:
            return False
        if index not in self._event_time:
            if step.trigger is not None:
                if index not in self._watch:
                    self._watch[index] = step.trigger(self._stage)
                if not self._watch[index]():
                    return False
            self._event_time[index] = time
        return time >= self._event_time[index] + step.after
