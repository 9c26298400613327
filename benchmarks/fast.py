"""`--speed max`: how many times faster than real time a vehicle flies open loop with its default telemetry."""

import statistics

from figures import Figure
from vehicle import HIL_STATE_QUATERNION, Vehicle, altitude_msl, sim_time

__all__ = ["measure"]

FLIGHTS = 7
FLIGHT = 100.0  # simulated [s]; left alone for much longer the vehicle spirals down
HOME = 488.0  # [m]


def measure() -> list[Figure]:
    """Simulated over wall time between the first and the last state heard in flight, two links being served."""
    return [
        Figure(
            "--speed max, default telemetry to two links", statistics.median(fly() for _ in range(FLIGHTS)), "x real"
        )
    ]


def fly() -> float:
    """One flight; raises RuntimeError if it ended on the ground, where there is less to compute."""
    heard: list[tuple[float, float]] = []
    options = ("--at=trim:30", "--autopilot=off", "--speed=max", f"--duration={FLIGHT}", f"--home=47.4,8.5,{HOME},0")
    with Vehicle(*options, count=2) as vehicle:
        vehicle.process.wait(60.0)
        vehicle.sockets[0].settimeout(0.2)
        height = HOME
        try:
            for arrival, payload, _ in vehicle.messages(HIL_STATE_QUATERNION):
                heard.append((arrival, sim_time(payload)))
                height = altitude_msl(payload)
        except RuntimeError:
            # Silence: all that was sent has been read.
            if vehicle.process.returncode != 0 or len(heard) < 3:
                raise
    if height < HOME + 2.0:
        raise RuntimeError(f"after {FLIGHT} s the vehicle is on the ground: the figure would not be one of flight")
    return (heard[-1][1] - heard[0][1]) / (heard[-1][0] - heard[0][0])
