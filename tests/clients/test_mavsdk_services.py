"""MAVSDK's plugins beside the flight: parameters, failures, calibration, shell, events, metadata, plain messages."""

import json
from typing import Any

import pytest
from mavsdk.plugins.calibration import Calibration
from mavsdk.plugins.component_metadata import ComponentMetadata
from mavsdk.plugins.events import Events
from mavsdk.plugins.failure import Failure, FailureError, FailureType, FailureUnit
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage
from mavsdk.plugins.param import Param, ParamError
from mavsdk.plugins.shell import Device, Shell

from sitl.flight.parameters import Parameters
from tests.clients.mavsdk_station import MavsdkStation, finished
from tests.clients.vehicle import until


def test_all_parameters_come_with_their_types_and_values(station: MavsdkStation) -> None:
    got = station.plugin(Param).get_all_params()
    values = {param.name: param.value for param in (*got.int_params, *got.float_params)}
    ours = Parameters()
    assert set(values) == set(ours.names())
    assert values == pytest.approx({name: ours[name] for name in values}, rel=1e-6)
    assert all(isinstance(param.value, int) for param in got.int_params)


def test_a_parameter_is_set_and_read_back(station: MavsdkStation) -> None:
    parameters = station.plugin(Param)
    parameters.set_param_float("RTL_DESCEND_ALT", 25.5)
    assert parameters.get_param_float("RTL_DESCEND_ALT") == 25.5
    parameters.set_param_int("WV_EN", 0)
    assert parameters.get_param_int("WV_EN") == 0
    parameters.set_param_int("WV_EN", 1)


@pytest.mark.parametrize(
    ("kind", "name", "value", "result"),
    [
        ("float", "RTL_DESCEND_ALT", 1e6, "VALUE_OUT_OF_RANGE"),
        ("float", "WV_EN", 1.0, "TYPE_MISMATCH"),
        ("int", "WV_EN", 7, "VALUE_OUT_OF_RANGE"),
        ("int", "NO_SUCH_PARAM", 1, "DOES_NOT_EXIST"),
    ],
)
def test_a_parameter_that_cannot_be_set_is_refused_for_what_is_wrong(
    station: MavsdkStation, kind: str, name: str, value: float, result: str
) -> None:
    with pytest.raises(ParamError, match=result):
        getattr(station.plugin(Param), f"set_param_{kind}")(name, value)


def test_failures_are_injected_once_a_parameter_allows_them(station: MavsdkStation) -> None:
    station.plugin(Param).set_param_int("SYS_FAILURE_EN", 1)
    failure = station.plugin(Failure)
    with pytest.raises(FailureError, match="UNSUPPORTED"):
        failure.inject(FailureUnit.SENSOR_GYRO, FailureType.OFF, 1)
    station.begin("trim:20")
    failure.inject(FailureUnit.SYSTEM_MOTOR, FailureType.OFF, 1)
    until(lambda: "Attitude lost" in station.texts)
    failure.inject(FailureUnit.SYSTEM_MOTOR, FailureType.OK, 1)
    station.plugin(Param).set_param_int("SYS_FAILURE_EN", 0)
    with pytest.raises(FailureError, match="DENIED"):
        failure.inject(FailureUnit.SYSTEM_MOTOR, FailureType.OFF, 1)


@pytest.mark.parametrize("sensor", ["gyro", "accelerometer", "magnetometer", "level_horizon"])
def test_a_calibration_tells_its_progress_and_succeeds(station: MavsdkStation, sensor: str) -> None:
    reports = finished(getattr(station.plugin(Calibration), f"calibrate_{sensor}_async"))
    shares = [data.progress for result, data in reports if result == "NEXT" and data.has_progress]
    assert reports[-1][0] == "SUCCESS"
    assert shares[-1] == 1.0
    assert len(set(shares)) > 5


def test_a_calibration_is_cancelled(station: MavsdkStation) -> None:
    calibration = station.plugin(Calibration)

    def calibrate(report: Any) -> None:
        calibration.calibrate_gyro_async(report)
        until(lambda: any("calibration started" in text for text in station.texts))
        calibration.cancel()

    assert finished(calibrate)[-1][0] == "CANCELLED"


def test_the_shell_answers(station: MavsdkStation) -> None:
    shell = station.plugin(Shell)
    heard: list[str] = []
    subscription = shell.subscribe_receive(lambda received, _: heard.append(received.data))
    # A moment passes before MAVSDK asks for answers to what it sends.
    until(lambda: shell.send("\n", Device.SHELL) and heard)
    shell.send("ver all\n", Device.SHELL)
    until(lambda: "tiltwing-sitl" in "".join(heard) and "".join(heard).endswith("nsh> "))
    shell.unsubscribe_receive(subscription)


def test_events_and_arming_checks_are_told_in_the_words_of_our_metadata(station: MavsdkStation) -> None:
    events = station.plugin(Events)
    told: list[Any] = []
    reports: list[Any] = []
    subscriptions = (
        events.subscribe_events(lambda event, _: told.append(event)),
        events.subscribe_health_and_arming_checks(lambda report, _: reports.append(report)),
    )
    until(lambda: reports and reports[-1].current_mode_intention.can_arm_or_run)
    assert reports[-1].current_mode_intention.mode_name == "Hold"
    station.action.arm()
    until(lambda: any(event.event_name == "armed" for event in told))
    (armed, *_) = (event for event in told if event.event_name == "armed")
    assert (armed.message, armed.event_namespace, armed.compid) == ("Armed", "tiltwing", 1)
    station.action.disarm()
    station.plugin(Param).set_param_float("FW_AIRSPD_TRIM", 12.0)
    until(lambda: not reports[-1].current_mode_intention.can_arm_or_run)
    assert any("FW_AIRSPD" in problem.message for problem in reports[-1].all_problems)
    station.plugin(Param).set_param_float("FW_AIRSPD_TRIM", 20.0)
    until(lambda: reports[-1].current_mode_intention.can_arm_or_run)
    events.unsubscribe_events(subscriptions[0])
    events.unsubscribe_health_and_arming_checks(subscriptions[1])


def test_metadata_of_the_vehicle_is_fetched_and_is_json(station: MavsdkStation) -> None:
    metadata = station.plugin(ComponentMetadata)
    got: dict[str, str] = {}
    subscription = metadata.subscribe_metadata_available(lambda new, _: got.update({new.type.name: new.json_metadata}))
    metadata.request_autopilot_component()
    until(lambda: "ALL_COMPLETED" in got)
    metadata.unsubscribe_metadata_available(subscription)
    assert set(got) == {"PARAMETER", "EVENTS", "ACTUATORS", "ALL_COMPLETED"}
    described = {parameter["name"] for parameter in json.loads(got["PARAMETER"])["parameters"]}
    assert described == set(Parameters().names())


def test_messages_pass_as_they_are_both_ways(station: MavsdkStation) -> None:
    direct = station.plugin(MavlinkDirect)
    answers: list[Any] = []
    subscription = direct.subscribe_message(
        "COMMAND_ACK", lambda message, _: answers.append(json.loads(message.fields_json))
    )
    fields = {
        "target_system": 1, "target_component": 1, "command": 512, "confirmation": 0, "param1": 148.0,
        "param2": 0.0, "param3": 0.0, "param4": 0.0, "param5": 0.0, "param6": 0.0, "param7": 0.0,
    }  # fmt: skip
    direct.send_message(MavlinkMessage("COMMAND_LONG", 245, 190, 1, 1, json.dumps(fields)))
    until(lambda: any(answer["command"] == 512 for answer in answers))
    direct.unsubscribe_message(subscription)
    (answer, *_) = (answer for answer in answers if answer["command"] == 512)
    assert answer["result"] == 0
    assert answer["target_system"] == 245
