"""TILT_STATUS for pymavlink's dialect, against the vehicle's own."""

import pytest
from pymavlink.dialects.v20 import all as mav

from gcs_scripts import tilt_status
from sitl.mavlink.dialect import tiltwing


def test_what_the_vehicle_packs_is_what_the_ground_reads_and_the_other_way_round() -> None:
    values = (123456, 0.5, 0.75, 1.25, tilt_status.LAGS)
    theirs = tiltwing.MAVLink_tilt_status_message(*values).pack(tiltwing.MAVLink(None, 1, 1))
    read = mav.MAVLink(None).decode(bytearray(theirs))
    assert read.get_type() == "TILT_STATUS"
    assert [getattr(read, name) for name in read.get_fieldnames()] == pytest.approx(values)
    assert tilt_status.MAVLink_tilt_status_message(*values).pack(mav.MAVLink(None, 1, 1)) == theirs


def test_flags_mean_what_they_mean_in_the_vehicles_dialect() -> None:
    flags = {entry.name: value for value, entry in tiltwing.enums["TILT_STATUS_FLAGS"].items()}
    assert tuple(sorted(flags.values())[:2]) == (tilt_status.LAGS, tilt_status.STOPPED)
