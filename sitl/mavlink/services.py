"""All microservices of the vehicle, in one list."""

from typing import TYPE_CHECKING

from sitl.mavlink.actuator_commands import ActuatorCommands
from sitl.mavlink.ardupilot_calibration import ArduPilotCalibration
from sitl.mavlink.command import CommandService
from sitl.mavlink.component_metadata import ComponentMetadataService
from sitl.mavlink.events import EventsService
from sitl.mavlink.external_estimates import ExternalEstimates
from sitl.mavlink.failure_injection import FailureInjectionService
from sitl.mavlink.flight_commands import FlightCommands
from sitl.mavlink.ftp import FtpService
from sitl.mavlink.ftp_mounts import standard_mounts
from sitl.mavlink.high_latency import HighLatencyService
from sitl.mavlink.home_position import HomePositionService
from sitl.mavlink.log import LogService
from sitl.mavlink.logging_stream import LoggingStreamService
from sitl.mavlink.manual_control import ManualControlService
from sitl.mavlink.mavlink_version import MavlinkVersionService
from sitl.mavlink.message_interval import MessageIntervalService
from sitl.mavlink.mission import MissionService
from sitl.mavlink.offboard import OffboardService
from sitl.mavlink.open_drone_id import OpenDroneIdService
from sitl.mavlink.parameter import ParameterService
from sitl.mavlink.ping import PingService
from sitl.mavlink.preflight import PreflightService
from sitl.mavlink.serial_control import SerialControlService
from sitl.mavlink.signing import SigningService
from sitl.mavlink.standard_modes import StandardModesService
from sitl.mavlink.terrain import TerrainService
from sitl.mavlink.timesync import TimesyncService

if TYPE_CHECKING:
    from sitl.mavlink.face import MavlinkFace
    from sitl.mavlink.service import Service

__all__ = ["microservices"]


def microservices(face: "MavlinkFace") -> "list[Service]":
    """Every microservice, for one vehicle."""
    modes = StandardModesService(face)
    events = EventsService(face)
    parameters = ParameterService(face)
    mission = MissionService(face)  # after the parameters: some of them say what missions are feasible
    metadata = ComponentMetadataService(face)
    by_hand = ArduPilotCalibration(face) if face.identity.calibrates_by_hand else None
    return [
        MessageIntervalService(face),
        MavlinkVersionService(face),
        parameters,
        mission,
        modes,
        FlightCommands(face, face.context, modes),
        HomePositionService(face, face.context),
        ActuatorCommands(face, face.context),
        FailureInjectionService(face),
        *([] if by_hand is None else [by_hand]),
        PreflightService(face, events.report, by_hand),
        ExternalEstimates(face),
        events,
        metadata,
        FtpService(face, standard_mounts(face, mission.plans, metadata=metadata.mounts)),
        OffboardService(face, face.context, modes),
        ManualControlService(face),
        SigningService(face, face.signing),
        TimesyncService(face),
        PingService(face),
        TerrainService(face),
        LogService(face, face.log),
        LoggingStreamService(face, face.log),
        SerialControlService(face),
        OpenDroneIdService(face),
        HighLatencyService(face),
        CommandService(face),  # the last: what others have under way ends first when the vehicle begins anew
    ]
