"""Each way of asking for something writes all of it, and nothing that was asked before stays in it."""

import math

import numpy as np
import pytest

from sitl.control.records import Horizontal, Level, Vertical, Yaw
from sitl.flight.demand import Demand


def test_a_task_is_written_to_the_record_that_the_laws_read() -> None:
    demand = Demand()
    record = demand.record[0]
    demand.leg((1.0, 2.0, -3.0), (4.0, 5.0, -6.0), speed=21.0, cruise=True)
    assert (record["level"], record["horizontal"], record["vertical"]) == (4, Horizontal.LEG, Vertical.ALTITUDE)
    np.testing.assert_array_equal(record["start_ned"], (1.0, 2.0, -3.0))
    np.testing.assert_array_equal(record["position_ned"], (4.0, 5.0, -6.0))
    assert (record["speed"], record["cruise"]) == (21.0, 1)
    demand.circle((7.0, 8.0, -9.0), -80.0, speed=4.0, cruise=False)
    np.testing.assert_array_equal(record["position_ned"], (7.0, 8.0, -9.0))
    assert (record["horizontal"], record["radius"], record["speed"]) == (Horizontal.CIRCLE, -80.0, 4.0)
    assert record["cruise"] == 0
    demand.velocity((1.0, -2.0, 0.5))
    np.testing.assert_array_equal(record["velocity_ned"], (1.0, -2.0, 0.5))
    assert (record["horizontal"], record["vertical"]) == (Horizontal.VELOCITY, Vertical.RATE)
    assert record["speed"] == pytest.approx(math.sqrt(5.0))
    demand.acceleration(0.3, -0.4)
    np.testing.assert_array_equal(record["acceleration"], (0.3, -0.4))
    assert record["horizontal"] == Horizontal.ACCELERATION
    demand.bank(0.2, speed=19.0)
    assert (record["horizontal"], record["bank"], record["speed"]) == (Horizontal.BANK, 0.2, 19.0)
    demand.attitude(0.1, -0.2, 0.3, 0.4, 1.5)
    assert record["level"] == Level.ATTITUDE
    assert [record[name] for name in ("roll", "pitch", "yaw_rate", "thrust", "tilt")] == [0.1, -0.2, 0.3, 0.4, 1.5]
    demand.direct([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])
    assert record["level"] == Level.DIRECT
    np.testing.assert_array_equal(record["direct"], [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])
    demand.limits(climb_rate=2.5, sink_rate=1.5, max_bank=0.6)
    assert [record[name] for name in ("climb_rate", "sink_rate", "max_bank")] == [2.5, 1.5, 0.6]


def test_what_a_task_does_not_say_goes_back_to_rest() -> None:
    demand = Demand()
    record = demand.record[0]
    demand.point((0.0, 0.0, -10.0), speed=5.0)
    demand.heading(1.0)
    demand.climb(-0.5)
    demand.limit_thrust(0.3)
    assert (record["yaw"], record["heading"], record["vertical"]) == (Yaw.HEADING, 1.0, Vertical.RATE)
    assert (record["velocity_ned"][2], record["thrust_limit"]) == (-0.5, 0.3)
    demand.point((0.0, 0.0, -10.0), speed=5.0)
    assert (record["yaw"], record["vertical"], record["thrust_limit"]) == (Yaw.COURSE, Vertical.ALTITUDE, 1.0)
    demand.limit_thrust(0.3)
    demand.idle()
    assert (record["level"], record["thrust_limit"]) == (Level.IDLE, 1.0)


def test_those_who_watch_are_told_what_is_asked() -> None:
    demand = Demand()
    assert demand.level == Level.OFF
    demand.limits(climb_rate=3.0, sink_rate=1.2, max_bank=0.5)
    demand.point((1.0, 2.0, -30.0), speed=5.0)
    assert (demand.level, demand.down, demand.down_rate, demand.sink_rate) == (Level.VELOCITY, -30.0, None, 1.2)
    demand.altitude(-40.0)
    assert demand.down == -40.0
    demand.climb(0.7)
    assert demand.down_rate == 0.7
    demand.attitude(0.0, 0.0, 0.0, 0.6)
    assert (demand.level, demand.thrust) == (Level.ATTITUDE, 0.6)
    demand.direct([0.2, 0.5, 0.9, 0.0, 0.0, 0.0, 0.0])
    assert (demand.level, demand.throttle) == (Level.DIRECT, 0.5)
