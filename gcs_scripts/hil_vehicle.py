"""A vehicle in hardware-in-the-loop simulation as the ground sees it: its true state in, servo outputs out.

Only MAVLink's `common` messages are used, so it makes no difference who simulates.
"""

from collections.abc import Sequence
from typing import Any

from pymavlink.dialects.v20 import all as mav

from gcs_scripts.connection import Vehicle, message_id
from gcs_scripts.errors import RefusedError

__all__ = ["HilVehicle"]

ACTUATORS = 16  # of HIL_ACTUATOR_CONTROLS
RETRY = 0.05  # [s], wall time: in lockstep time stands still meanwhile


class HilVehicle(Vehicle):
    """A vehicle that takes HIL_ACTUATOR_CONTROLS and tells HIL_STATE_QUATERNION."""

    def send_controls(self, outputs: Sequence[float], time_us: int) -> None:
        """HIL_ACTUATOR_CONTROLS: normalised outputs by channel, for the state of the vehicle's time `time_us`."""
        controls = [*outputs, *[0.0] * (ACTUATORS - len(outputs))]
        armed = mav.MAV_MODE_FLAG_SAFETY_ARMED | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        self.send.hil_actuator_controls_send(time_us, controls, armed, 0)

    def state(self) -> Any:
        """The present HIL_STATE_QUATERNION, asked for. Raises UnansweredError when none comes, LinkLostError."""
        self.receive((), 0.0)  # what has been waiting to be read is not the present
        return self.ask(
            lambda: self.request("HIL_STATE_QUATERNION"),
            "HIL_STATE_QUATERNION",
            lambda _: True,
            f"system {self.system} does not tell its state: no HIL_STATE_QUATERNION",
            retry=RETRY,
        )

    def tick(self, outputs: Sequence[float], time_us: int) -> Any:
        """In lockstep: answer the state of `time_us` and return the next, HIL_STATE_QUATERNION of a later time.

        What gets lost is sent again. Raises UnansweredError when no later state comes, LinkLostError.
        """
        return self.ask(
            lambda: self.send_controls(outputs, time_us),
            "HIL_STATE_QUATERNION",
            lambda state: state.time_usec > time_us,
            f"system {self.system} does not go on from {time_us} us in answer to HIL_ACTUATOR_CONTROLS",
            retry=RETRY,
        )

    def stream(self, name: str, rate: float) -> None:
        """Ask for a message at `rate` [Hz] of the vehicle's time. Raises RefusedError, and as `ask`."""
        command = mav.MAV_CMD_SET_MESSAGE_INTERVAL
        what = f"SET_MESSAGE_INTERVAL for {name}"
        result = self.try_command(command, message_id(name), round(1e6 / rate), name=what, retry=RETRY)
        if result != mav.MAV_RESULT_ACCEPTED:
            raise RefusedError(f"system {self.system} refuses {name} at {rate:g} Hz: MAV_RESULT {result}")

    def stream_by_default(self, name: str) -> None:
        """Leave a message to the vehicle's own rate again, without waiting: one that has ended gives no answer."""
        self.set_interval(name, 0)
