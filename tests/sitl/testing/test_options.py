"""Options of a test against the command line that they become: the vehicle's own parser reads them."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sitl.cli import Options, parse_options
from sitl.testing.options import SitlOptions
from sitl.testing.process import SitlError


def parsed(**options: Any) -> Options:
    options_read = parse_options(SitlOptions.of(options).command_line(4321))
    assert options_read is not None
    return options_read


def test_without_options_everything_is_as_the_vehicle_has_it_but_link_and_system() -> None:
    plain = parse_options(["--sysid", "1"])
    assert plain is not None
    assert parsed() == plain._replace(links=("udpout:127.0.0.1:4321,normal",))


def test_each_option_is_understood_by_the_vehicle() -> None:
    options = parsed(
        speed=12.5, seed=7, at="trim:20", wind=(-3, 1.5), home=(-10.0, 20.0, 30.0, 40.0), scenario="a b.toml",
        aircraft=Path("mine.toml"), system_id=9, streams="onboard", arguments=["--earth", "wgs84", "--duration=60"],
        identity="ardupilot", params={"FW_AIRSPD_TRIM": np.float64(21.5), "NAV_RCL_ACT": 3}, state="kept",
    )  # fmt: skip
    assert (options.speed, options.seed, options.at, options.wind) == (12.5, 7, "trim:20", (-3.0, 1.5, 0.0))
    assert options.home == (-10.0, 20.0, 30.0, 40.0)
    assert (options.scenario, options.aircraft) == (Path("a b.toml"), Path("mine.toml"))
    assert (options.system_id, options.links) == (9, ("udpout:127.0.0.1:4321,onboard",))
    assert (options.earth, options.duration) == ("wgs84", 60.0)
    assert (options.identity, options.state) == ("ardupilot", Path("kept"))
    assert options.parameters == ("FW_AIRSPD_TRIM=21.5", "NAV_RCL_ACT=3")


@pytest.mark.parametrize(("speed", "factor"), [(1, 1.0), ("2.5", 2.5), ("max", math.inf), (math.inf, math.inf)])
def test_a_speed_is_a_number_a_text_or_max(speed: float | str, factor: float) -> None:
    assert SitlOptions(speed=speed).speed_factor == factor
    assert parsed(speed=speed).speed == factor


def test_an_option_that_there_is_not_is_named_with_those_there_are() -> None:
    with pytest.raises(SitlError, match=r"expected an option among speed, seed, .*, got 'sped'"):
        SitlOptions.of({"sped": 2})


def test_no_speed_is_refused() -> None:
    with pytest.raises(SitlError, match="expected a speed that is a positive number or max, got 'fast'"):
        SitlOptions(speed="fast").command_line(1)
