"""`--speed max`: how many times faster than real time a vehicle flies with its default telemetry."""

import statistics

from figures import Figure
from vehicle import HIL_STATE_QUATERNION, Vehicle, altitude_msl, sim_time

__all__ = ["measure"]

FLIGHTS = 7
OPEN_LOOP = 100.0  # simulated [s]; left alone for much longer the vehicle spirals down
FLIGHT = 1000.0
HOME = 488.0  # [m]


def measure() -> list[Figure]:
    """Simulated over wall time between the first and the last state heard in flight, two links being served."""
    open_loop = [fly(OPEN_LOOP, "--at=trim:30", "--autopilot=off") for _ in range(FLIGHTS)]
    flown = [fly(FLIGHT, "--at=trim:20") for _ in range(FLIGHTS)]
    return [
        Figure("--speed max, autopilot off", statistics.median(open_loop), "x real"),
        Figure("--speed max, default telemetry to a station and an SDK", statistics.median(flown), "x real", 300.0),
    ]


def fly(duration: float, *options: str) -> float:
    """One flight; raises RuntimeError if it ended on the ground, where there is less to compute."""
    heard: list[tuple[float, float]] = []
    options = (*options, "--speed=max", f"--duration={duration}", f"--home=47.4,8.5,{HOME},0")
    with Vehicle(*options, streams=("normal", "onboard")) as vehicle:
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
        raise RuntimeError(f"after {duration} s the vehicle is on the ground: the figure would not be one of flight")
    return (heard[-1][1] - heard[0][1]) / (heard[-1][0] - heard[0][0])
