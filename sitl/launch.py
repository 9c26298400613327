"""From checked options to a vehicle in flight: builds the objects, connects them, runs them, takes them down."""

import math
import os
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sitl.airframe import FlightDivergedError
from sitl.clock import Clock
from sitl.control.design import design_for
from sitl.flight.parameter_file import ParameterFileError, parse_parameters
from sitl.flight.plan_file import PlanError
from sitl.mavlink import LinkError, LinkSpec, MavlinkFace, parse_link
from sitl.mavlink.identity import IDENTITIES
from sitl.mavlink.signing import Signing
from sitl.mavlink.signing_key import SigningError, read_key
from sitl.mavlink.state_folder import StateError, StateFolder
from sitl.mavlink.tape import Tape, TapeError
from sitl.runtime import Runtime
from sitl.scenario import Scenario, ScenarioError, load_scenario
from sitl.simulation import Simulation
from sitl.start import StartError
from sitl.status import Status
from sitl.viewer import Viewer, ViewerOptionError, open_viewer
from vehicle_model.aircraft import AircraftFileError, load_aircraft
from vehicle_model.compiled import cache_folder, is_warm

if TYPE_CHECKING:
    from types import FrameType

    from sitl.cli import Options

__all__ = ["LaunchError", "fly"]

GROUND_STATION_LINK = "udpout:127.0.0.1:14550"  # where ground stations listen
SDK_LINK = "udpout:127.0.0.1:14540"  # where SDKs listen, with PX4's faster set of streams
REALTIME_PRIORITY = 50  # of SCHED_FIFO's 1 to 99


class LaunchError(Exception):
    """The flight cannot begin, or could not go on; the text is one line for the user."""

    def __init__(self, text: str, exit_code: int) -> None:
        super().__init__(text)
        self.exit_code = exit_code


def fly(options: "Options") -> int:
    """Fly as the options say and return the exit code: 0, or 128 + the signal that ended the flight.

    Raises LaunchError.
    """
    status = Status(sys.stdout)
    try:
        links = options.links or (GROUND_STATION_LINK, SDK_LINK)
        specs = [_shifted(parse_link(text), options.instance) for text in links]
        if not is_warm(cache_folder(Path(__file__).parent)):
            from sitl.warm import warm_up  # brings all of the analysis along, which a warm start need not load

            warm_up(status.say)
        simulation = _vehicle(options, status)
        with (
            StateFolder(options.state) as state,
            open_viewer(options.rerun, simulation.aircraft, map=not options.no_map) as viewer,
        ):
            signing = _signing(options, state)

            def tell(severity: int, text: str) -> None:
                viewer.text(severity, text)
                status.say(text)

            with MavlinkFace(
                specs,
                simulation,
                identity=IDENTITIES[options.identity],
                system_id=None if options.autopilot else options.system_id,
                servos_sysid=options.servos,
                servo_timeout=options.servo_timeout,
                speed=options.speed,
                lockstep=options.lockstep,
                state=state,
                signing=signing,
                tape=_tape(options),
                on_text=tell,
            ) as face:
                runtime = Runtime(
                    simulation,
                    face,
                    Clock(options.speed, options.rate),
                    viewer,
                    status,
                    duration=options.duration,
                    wait_servos=options.wait_servos,
                    lockstep=options.lockstep,
                )
                _introduce(status, options, simulation, specs, viewer, face.system)
                if options.realtime_priority:
                    _ask_for_realtime_priority(status)
                received = _stop_on_signals(runtime)
                runtime.run()
                return 128 + received[0] if received else 0
    except (
        AircraftFileError, ScenarioError, StartError, PlanError, LinkError, ParameterFileError, SigningError,
        StateError, TapeError, ViewerOptionError,
    ) as error:  # fmt: skip
        raise LaunchError(str(error), 2) from None
    except FlightDivergedError as error:
        raise LaunchError(str(error), 1) from None
    finally:
        status.close()


def _vehicle(options: "Options", status: Status) -> Simulation:
    """The simulation at its start, everything it calls compiled or loaded."""
    scenario = Scenario() if options.scenario is None else load_scenario(options.scenario)
    aircraft = load_aircraft(scenario.aircraft if options.aircraft is None else options.aircraft)
    parameters = parse_parameters(options.parameters, options.parameter_files)
    if options.system_id is not None:
        parameters["MAV_SYS_ID"] = options.system_id
    if options.autopilot:
        design_for(aircraft, status.say)  # that of a new aircraft takes a while
    simulation = Simulation(
        scenario,
        aircraft=aircraft,
        seed=options.seed,
        start=options.at,
        wind=options.wind,
        home=options.home,
        earth=options.earth,
        parameters=parameters,
        autopilot=options.autopilot,
        rate=options.rate,
    )
    if options.autopilot and options.speed == math.inf:
        # Wall time says nothing about how long a link has been silent when time runs as fast as it can.
        simulation.flight.links.enforced = simulation.scenario.links_enforced
    if options.speed < math.inf:
        simulation.pace = options.speed
    simulation.airframe.advance(0)
    simulation.snapshot()
    return simulation


def _signing(options: "Options", state: StateFolder) -> Signing:
    """The key that is stored, or the one given, which goes before it."""
    return Signing(state, None if options.signing_key is None else read_key(options.signing_key))


def _tape(options: "Options") -> Tape | None:
    return None if options.tlog is None else Tape(options.tlog)


def _shifted(spec: LinkSpec, instance: int) -> LinkSpec:
    """The link of the n-th vehicle on this machine: its port moved by n."""
    if instance == 0:
        return spec
    port = spec.port + instance
    if port >= 1 << 16:
        msg = f"link {spec.text!r}: expected a port below 65536 with instance {instance}, got {port}"
        raise LinkError(msg)
    return replace(spec, port=port, text=f"{spec.kind}:{spec.host}:{port}")


def _introduce(
    status: Status, options: "Options", simulation: Simulation, specs: list[LinkSpec], viewer: Viewer, system: int
) -> None:
    """Tell where the vehicle is, where to connect and where to watch."""
    home = simulation.scenario.home
    flown_by = "autopilot on" if options.autopilot else "autopilot off, controls are held"
    status.say(
        f"Tilt-wing, system {system}: {simulation.description}, {flown_by}; "
        f"home {home.latitude:g}, {home.longitude:g}, {home.altitude:g} m, heading {home.heading:g} deg"
    )
    for spec in specs:
        listener = "listens there" if spec.kind.endswith("in") else "sends there"
        status.say(f"  connect  {spec.text}  ({listener}; {spec.streams} streams)")
    if viewer.address:
        status.say(f"  watch    {viewer.address}")
    if options.lockstep:
        status.say(f"  lockstep: each HIL_ACTUATOR_CONTROLS advances time by {1e3 / options.rate:g} ms")
    elif options.wait_servos:
        status.say("  time stands still until the first servo output")
    status.say("  Ctrl-C ends")


def _ask_for_realtime_priority(status: Status) -> None:
    """Let the flight loop preempt everything of normal priority, where the system has and permits that."""
    if sys.platform != "linux":
        status.say("Real-time priority: not available on this system, flying without")
        return
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(REALTIME_PRIORITY))
    except OSError as error:
        status.say(f"Real-time priority: refused ({error.strerror}), flying without")


def _stop_on_signals(runtime: Runtime) -> list[int]:
    """End the flight at the first Ctrl-C or SIGTERM and note it in the list returned; a second one is not caught."""
    received: list[int] = []

    def stop(number: int, _frame: "FrameType | None") -> None:
        received.append(number)
        signal.signal(number, signal.SIG_DFL)
        runtime.stop()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    return received
