"""Manual control: a pilot's sticks, as MANUAL_CONTROL or as RC_CHANNELS_OVERRIDE.

https://mavlink.io/en/services/manual_control.html. One sender has the sticks until it has been silent for
COM_RC_LOSS_T, by the pilot's own clock; what others send meanwhile is ignored.
"""

import math
from collections.abc import Mapping
from typing import Any

from sitl.flight.manual_input import ManualInput
from sitl.flight.refused import Refused
from sitl.mavlink.service import Exchange, Handler, Sender, Service

__all__ = ["ManualControlService"]

UNUSED = 0x7FFF  # INT16_MAX: an axis that is not there
FULL = 1000.0
CENTRE, TRAVEL = 1500.0, 500.0  # of a channel [us]
RELEASED, IGNORED = 0, 0xFFFF
SHORTEST, LONGEST = 800, 2200  # pulse there is [us]
NO_STICKS = 4  # of COM_RC_IN_MODE
ROLL, PITCH, THROTTLE, YAW = range(4)  # channels 1 to 4


class ManualControlService(Service):
    """Passes sticks to the flight."""

    def __init__(self, exchange: Exchange) -> None:
        """Serve through `exchange`."""
        super().__init__(exchange)
        self._pilot: tuple[int, int] | None = None
        self._heard = -math.inf  # simulated time [s]
        self._channels: dict[int, float] = {}  # overridden pulses [us], by channel from 0

    def messages(self) -> Mapping[str, Handler]:
        """See Service."""
        return {"MANUAL_CONTROL": self._on_manual_control, "RC_CHANNELS_OVERRIDE": self._on_override}

    def restarted(self) -> None:
        """See Service."""
        self._pilot = None
        self._heard = -math.inf
        self._channels.clear()

    def _on_manual_control(self, message: Any, sender: Sender) -> None:
        self._fly(
            ManualInput(
                forward=_stick(message.x),
                right=_stick(message.y),
                throttle=0.5 if message.z == UNUSED else min(max(message.z / FULL, 0.0), 1.0),
                turn=_stick(message.r),
            ),
            sender,
        )

    def _on_override(self, message: Any, sender: Sender) -> None:
        """RC_CHANNELS_OVERRIDE: the pitch channel is long with the stick pulled, as on a transmitter."""
        if not self._has_sticks(sender):
            return
        for channel in range(4):
            pulse = message[2 + channel]
            if pulse == RELEASED:
                self._channels.pop(channel, None)
            elif pulse != IGNORED and SHORTEST <= pulse <= LONGEST:
                self._channels[channel] = pulse
        if self._channels:
            sticks = [_within((self._channels.get(n, CENTRE) - CENTRE) / TRAVEL) for n in range(4)]
            self._fly(
                ManualInput(
                    forward=-sticks[PITCH],
                    right=sticks[ROLL],
                    throttle=0.5 + 0.5 * sticks[THROTTLE],
                    turn=sticks[YAW],
                ),
                sender,
            )

    def _fly(self, sticks: ManualInput, sender: Sender) -> None:
        if not self._has_sticks(sender):
            return
        try:
            self.exchange.simulation.flight.manual(sticks)
        except Refused:
            return  # there is no flight controller: whoever streams sticks need not be told at every turn
        self._pilot = (sender.system, sender.component)
        self._heard = self.exchange.simulation.time

    def _has_sticks(self, sender: Sender) -> bool:
        simulation = self.exchange.simulation
        if not simulation.autopilot:
            return False
        parameters = simulation.flight.parameters
        if parameters["COM_RC_IN_MODE"] == NO_STICKS:
            return False
        silent = (simulation.time - self._heard) / simulation.pace
        return silent > parameters["COM_RC_LOSS_T"] or self._pilot in (None, (sender.system, sender.component))


def _stick(value: int) -> float:
    return 0.0 if value == UNUSED else _within(value / FULL)


def _within(value: float) -> float:
    return min(max(value, -1.0), 1.0)
