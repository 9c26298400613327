"""The paper's elevator step (Figs 11-12) flown over MAVLink and compared with the model's own time history.

Holds a vehicle in trim through HIL_ACTUATOR_CONTROLS, steps the elevator, records HIL_STATE_QUATERNION and compares
with what `python -m vehicle_model step --json` wrote. In lockstep each message is one period of the flight and the two
must agree; in real time the figures are only stated, for a step can then fall anywhere within a period.
"""

import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from gcs_scripts.command_line import CONTEXT, Connect, Reach, System, Timeout, application, run
from gcs_scripts.connection import OWN_SYSTEM, connect
from gcs_scripts.errors import ExitCode, GroundError, LinkLostError
from gcs_scripts.hil_vehicle import HilVehicle
from gcs_scripts.step_response import (
    Deviation,
    Reference,
    Response,
    check_start,
    compare,
    read_reference,
    response,
)  # fmt: skip

__all__ = ["Timing", "fly_in_lockstep", "fly_in_real_time", "main"]

PROGRAM = "elevator_step"
STREAM_RATE = 400.0  # [Hz] of the vehicle's time
CONTROL_PERIOD = 0.02  # [s]; controls go out at least so often, of the vehicle's time as well as of ours


def fly_in_lockstep(vehicle: HilVehicle, reference: Reference) -> Response:
    """Fly the step with the vehicle's time in our hands: one HIL_ACTUATOR_CONTROLS, one period.

    Raises GroundError when the vehicle does not begin as the reference does, stops, or takes other steps in time.
    """
    state = vehicle.state()
    check_start(state, reference)
    states = [state]
    begin, now = state.time_usec, state.time_usec
    count = round((reference.time[-1] - reference.time[0]) * reference.rate)
    for i in range(count):
        due = begin + round((i + 1) * 1e6 / reference.rate)
        is_stepped = i >= round(reference.step_time * reference.rate)
        state = vehicle.tick(reference.outputs_after if is_stepped else reference.outputs_before, now)
        now = state.time_usec
        if abs(now - due) > 1:
            raise GroundError(
                f"system {vehicle.system} went on to {now} us, expected {due}: is it in lockstep at"
                f" {reference.rate:g} Hz, and are we the only one to give it servo outputs?"
            )
        states.append(state)
    return response(states)


class Timing:
    """How the states of a real-time flight arrived.

    Attributes:
        speed: simulated seconds per wall second.
        rate: states per simulated second.
        lost: messages of any kind lost on the way.
        jitter_p50, jitter_p99, jitter_max: how far arrivals are from evenly spaced ones [s of wall time].
        delay: from sending the step to its being in force [s of the vehicle's time].
    """

    def __init__(self, simulated: np.ndarray, arrival: np.ndarray, lost: int, delay: float) -> None:
        """Judge arrivals (n,) [s, wall] of states at times (n,) [s, simulated]."""
        slope, offset = np.polyfit(simulated - simulated[0], arrival - arrival[0], 1)
        late = np.abs(arrival - arrival[0] - offset - slope * (simulated - simulated[0]))
        self.speed = float(1.0 / slope)
        self.rate = float((len(simulated) - 1) / (simulated[-1] - simulated[0]))
        self.lost = lost
        self.jitter_p50, self.jitter_p99 = (float(np.percentile(late, p)) for p in (50, 99))
        self.jitter_max = float(late.max())
        self.delay = delay

    def __str__(self) -> str:
        return (
            f"{self.speed:.4g} x real time, {self.rate:.1f} states a second, {self.lost} messages lost; arrival jitter"
            f" p50 {1e3 * self.jitter_p50:.2f}, p99 {1e3 * self.jitter_p99:.2f}, max {1e3 * self.jitter_max:.2f} ms;"
            f" step in force {1e3 * self.delay:.1f} ms of the vehicle's time after it was sent"
        )


def fly_in_real_time(vehicle: HilVehicle, reference: Reference) -> tuple[Response, Timing]:
    """Fly the step while the vehicle keeps time; the response's time is zero where the reference's is.

    The two are aligned by when the vehicle's SERVO_OUTPUT_RAW, its commands in force, shows the step. Raises
    GroundError as `fly_in_lockstep` does.
    """
    check_start(vehicle.state(), reference)
    vehicle.stream("HIL_STATE_QUATERNION", STREAM_RATE)
    vehicle.stream("SERVO_OUTPUT_RAW", STREAM_RATE)
    try:
        return _record_in_real_time(vehicle, reference)
    finally:
        for name in ("HIL_STATE_QUATERNION", "SERVO_OUTPUT_RAW"):
            vehicle.stream_by_default(name)


def _record_in_real_time(vehicle: HilVehicle, reference: Reference) -> tuple[Response, Timing]:
    moved = [
        n for n, (a, b) in enumerate(zip(reference.outputs_before, reference.outputs_after, strict=True)) if a != b
    ]
    before = vehicle.state()
    states, arrivals = [before], [time.monotonic()]
    begin_us = now_us = before.time_usec
    lost = vehicle.lost
    outputs = reference.outputs_before
    sent_us, sent_wall = -math.inf, -math.inf
    step_sent_us = step_us = None
    held_us, held = now_us, None  # the last SERVO_OUTPUT_RAW without the step: when, and its pulses
    end_us = begin_us + 1e6 * (reference.time[-1] - reference.time[0])
    while now_us < end_us:
        wall = time.monotonic()
        if wall - arrivals[-1] > vehicle.timeout:
            raise LinkLostError(f"system {vehicle.system} fell silent: no state after {now_us} us")
        if step_sent_us is None and now_us - begin_us >= 1e6 * reference.step_time:
            outputs, step_sent_us, sent_us = reference.outputs_after, now_us, -math.inf
        if now_us - sent_us >= 1e6 * CONTROL_PERIOD or wall - sent_wall >= CONTROL_PERIOD:
            vehicle.send_controls(outputs, now_us)
            sent_us, sent_wall = now_us, wall
        message = vehicle.receive(("HIL_STATE_QUATERNION", "SERVO_OUTPUT_RAW"), CONTROL_PERIOD)
        if message is None:
            continue
        if message.get_type() == "HIL_STATE_QUATERNION":
            if message.time_usec > now_us:
                now_us = message.time_usec
                states.append(message)
                arrivals.append(time.monotonic())
        elif step_us is None:
            pulses = [getattr(message, f"servo{n + 1}_raw") for n in moved]
            if step_sent_us is None or pulses == held:
                held_us, held = _unwrapped(message.time_usec, now_us), pulses
            else:
                step_us = held_us  # controls act from the last state that does not show them
                end_us += step_us - begin_us - 1e6 * reference.step_time
    if step_us is None or step_sent_us is None:
        raise GroundError(f"system {vehicle.system} never showed the step in SERVO_OUTPUT_RAW")
    flown = response(states)
    timing = Timing(flown.time, np.array(arrivals), vehicle.lost - lost, (step_us - step_sent_us) * 1e-6)
    return flown.shifted(reference.step_time - (step_us - begin_us) * 1e-6), timing


def _unwrapped(low_us: int, near_us: int) -> int:
    """The time that ends in these 32 bits and is nearest to another [us]."""
    return near_us + (low_us - near_us + (1 << 31)) % (1 << 32) - (1 << 31)


def report(deviations: Sequence[Deviation], *, judged: bool) -> str:
    """The largest deviations as lines of text, with a verdict where there is one."""
    lines = [f"{'':16}{'largest deviation':>22}{'at':>10}{'limit':>12}"]
    for d in deviations:
        verdict = ("" if d.passed else "  FAILED") if judged else ""
        lines.append(
            f"{d.name:16}{f'{d.largest:.3g} {d.unit}':>22}{f'{d.time:.3f} s':>10}{f'{d.limit:.3g}':>12}{verdict}"
        )
    return "\n".join(lines)


_application = application()


@_application.command(name=PROGRAM, context_settings=CONTEXT)
def _command(
    reference_file: Annotated[
        Path, typer.Argument(metavar="REFERENCE", help="What `python -m vehicle_model step --json` wrote.")
    ],
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="The vehicle waits for each of our messages; judge the flight.")
    ] = False,
    plot: Annotated[Path | None, typer.Option(metavar="FILE.png", help="Draw the flight over the reference.")] = None,
    sysid: Annotated[int, typer.Option(metavar="ID", min=1, max=255, help="Our MAVLink system id.")] = OWN_SYSTEM,
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """Step the elevator of a trimmed vehicle over MAVLink and compare with the model's own time history.

    Exit codes: 0 the flight agrees (in real time: was flown), 1 in lockstep it differs, 2 wrong option, file or start,
    3 the vehicle refused, 4 no vehicle or link lost, 5 no answer in time.
    """
    reference = read_reference(reference_file)
    reach = Reach().but(link, timeout, system)
    with connect(
        reach.connection, timeout=reach.timeout, system=reach.system, own_system=sysid, kind=HilVehicle
    ) as vehicle:
        if lockstep:
            flown, timing, how = fly_in_lockstep(vehicle, reference), None, "in lockstep"
        else:
            flown, timing = fly_in_real_time(vehicle, reference)
            how = f"at {timing.speed:.3g} x real time"
    deviations = compare(flown, reference)
    print(f"System {vehicle.system}: {len(flown.time)} states over {flown.time[-1] - flown.time[0]:.3f} s, {how}")
    if timing is not None:
        print(timing)
    print(report(deviations, judged=lockstep))
    if plot is not None:
        from gcs_scripts.step_figure import draw

        draw(plot, flown, reference, how)
        print(f"Drawn in {plot}")
    failed = [d for d in deviations if not d.passed] if lockstep else []
    for d in failed:
        text = f"{d.name} differs by {d.largest:.3g} {d.unit} at {d.time:.3f} s, more than {d.limit:.3g} ({d.reason})"
        print(f"{PROGRAM}: {text}", file=sys.stderr)
    return ExitCode.DIFFERS if failed else ExitCode.DONE


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    return run(_application, PROGRAM, arguments)


if __name__ == "__main__":
    sys.exit(main())
