"""`--speed max`: how many times faster than real time a vehicle flies open loop with its default telemetry."""

from figures import Figure
from vehicle import HIL_STATE_QUATERNION, Vehicle, sim_time

__all__ = ["measure"]

FLIGHT = 3000.0  # simulated [s]
WALL = 5.0  # at most [s]


def measure() -> list[Figure]:
    """Simulated over wall time between the first and the last state heard, two links being served."""
    with Vehicle("--at=ground", "--speed=max", f"--duration={FLIGHT}", count=2) as vehicle:
        stream = vehicle.messages(HIL_STATE_QUATERNION)
        begin, payload, _ = next(stream)
        sim_begin = sim_time(payload)
        vehicle.sockets[0].settimeout(1.0)
        end, sim_end = begin, sim_begin
        try:
            for arrival, payload, _ in stream:
                end, sim_end = arrival, sim_time(payload)
                if end - begin > WALL:
                    break
        except RuntimeError:
            # The flight was over sooner: silence after its last message is what was to be expected.
            if vehicle.process.poll() != 0:
                raise
    return [Figure("--speed max, two links", (sim_end - sim_begin) / (end - begin), "x real")]
