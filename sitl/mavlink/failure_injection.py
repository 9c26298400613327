"""Failure injection: motors that stop or weaken, servos that stick, links that fall silent, and all well again.

MAV_CMD_INJECT_FAILURE, allowed by the parameter SYS_FAILURE_EN as with PX4. What is not modelled is UNSUPPORTED, so
that nobody takes a test for passed that has tested nothing.
"""

from collections.abc import Callable, Mapping

from sitl.fate import ROTORS
from sitl.flight.refused import Refused
from sitl.mavlink.command import Command, CommandHandler, whole_number
from sitl.mavlink.dialect import tiltwing as mav
from sitl.mavlink.service import Service
from vehicle_model.state import SERVO_NAMES

__all__ = ["FailureInjectionService"]

OK, OFF, STUCK, SLOW = mav.FAILURE_TYPE_OK, mav.FAILURE_TYPE_OFF, mav.FAILURE_TYPE_STUCK, mav.FAILURE_TYPE_SLOW
WEAK = 0.2  # share of its thrust that a slow motor has lost


class FailureInjectionService(Service):
    """INJECT_FAILURE."""

    def commands(self) -> Mapping[int, CommandHandler]:
        """See Service."""
        return {mav.MAV_CMD_INJECT_FAILURE: self._inject}

    def _inject(self, command: Command) -> int:
        simulation = self.exchange.simulation
        unit, kind, instance = (whole_number(value) for value in command.params[:3])
        if not simulation.flight.parameters["SYS_FAILURE_EN"]:
            msg = "no failure injected: SYS_FAILURE_EN is 0"
            raise Refused(msg)
        units: dict[int, tuple[tuple[str, ...], dict[int, Callable[[str], None]]]] = {
            mav.FAILURE_UNIT_SYSTEM_MOTOR: (
                ROTORS,
                {
                    OK: simulation.repair_motor,
                    OFF: lambda name: simulation.fail_motor(name, 1.0),
                    SLOW: lambda name: simulation.fail_motor(name, WEAK),
                },
            ),
            mav.FAILURE_UNIT_SYSTEM_SERVO: (
                SERVO_NAMES,
                {OK: simulation.repair_servo, STUCK: simulation.fail_servo, OFF: simulation.fail_servo},
            ),
            mav.FAILURE_UNIT_SYSTEM_RC_SIGNAL: (("manual_control",), _of_link(simulation.cut_link)),
            mav.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL: (("ground_station",), _of_link(simulation.cut_link)),
        }
        names, actions = units.get(-1 if unit is None else unit, ((), {}))
        action = actions.get(-1 if kind is None else kind)
        if action is None:
            return mav.MAV_RESULT_UNSUPPORTED
        instance = instance or 0  # all of them
        if not 0 <= instance <= len(names):
            msg = f"failure: expected instance 0 (all) to {len(names)} ({', '.join(names)}), got {instance}"
            raise Refused(msg)
        for name in names if instance == 0 else (names[instance - 1],):
            action(name)
        return mav.MAV_RESULT_ACCEPTED


def _of_link(cut: Callable[[str, bool], None]) -> dict[int, Callable[[str], None]]:
    return {OK: lambda name: cut(name, False), OFF: lambda name: cut(name, True)}
