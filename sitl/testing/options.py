"""What a test can ask of its vehicle: the options of the marker, as arguments of the command line."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from sitl.testing.process import SitlError

__all__ = ["SitlOptions"]


@dataclass(frozen=True, kw_only=True)
class SitlOptions:
    """Options of a vehicle. What is None is as the vehicle has it without; values are checked by the vehicle.

    Attributes:
        speed: times real time, or "max".
        seed: where random streams begin, those of the vehicle and those of the wire's faults.
        at: "ground", "trim:AIRSPEED" or a start file.
        wind: steady, blowing to, north, east and perhaps down [m/s].
        home: latitude, longitude [deg], altitude [m], heading [deg].
        identity: "px4", "ardupilot" or "generic".
        scenario, aircraft: files.
        params: parameters by name.
        state: folder where parameters and missions outlive a restart; nowhere if None.
        system_id: MAVLink system id.
        port: where the client listens; a free one if None. Several vehicles may be given the same.
        streams: "normal" for the default streams of ground stations, "onboard" for those of SDKs.
        arguments: more for the command line, as `python -m sitl --help` lists them.
        start_timeout: for the first heartbeat [s], wall time; the first start after an installation compiles.
    """

    speed: float | str = 1.0
    seed: int | None = None
    at: str | Path | None = None
    wind: Sequence[float] | None = None
    home: Sequence[float] | None = None
    identity: str | None = None
    scenario: str | Path | None = None
    aircraft: str | Path | None = None
    params: Mapping[str, float] = field(default_factory=dict[str, float])
    state: str | Path | None = None
    system_id: int = 1
    port: int | None = None
    streams: str = "normal"
    arguments: Sequence[str] = ()
    start_timeout: float = 300.0

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> "SitlOptions":
        """Options by name. Raises SitlError for one that there is not."""
        known = [each.name for each in fields(cls)]
        for name in given:
            if name not in known:
                msg = f"tiltwing_sitl: expected an option among {', '.join(known)}, got {name!r}"
                raise SitlError(msg)
        return cls(**given)

    @property
    def speed_factor(self) -> float:
        """Simulated seconds per wall second, inf for "max". Raises SitlError for what is no speed."""
        try:
            return math.inf if self.speed == "max" else float(self.speed)
        except ValueError:
            msg = f"tiltwing_sitl: expected a speed that is a positive number or max, got {self.speed!r}"
            raise SitlError(msg) from None

    def command_line(self, port: int) -> list[str]:
        """Arguments for a vehicle that sends to a port of the loopback."""
        speed = self.speed_factor
        given: list[tuple[str, Any]] = [
            ("link", f"udpout:127.0.0.1:{port},{self.streams}"),
            ("sysid", self.system_id),
            ("speed", "max" if speed == math.inf else str(speed)),
            ("seed", self.seed),
            ("at", self.at),
            ("wind", _joined(self.wind)),
            ("home", _joined(self.home)),
            ("identity", self.identity),
            ("scenario", self.scenario),
            ("aircraft", self.aircraft),
            ("state", self.state),
            *(("param", f"{name}={value}") for name, value in self.params.items()),
        ]
        # With an equals sign, for a wind may begin with a minus.
        return [*(f"--{name}={value}" for name, value in given if value is not None), *self.arguments]


def _joined(values: Sequence[float] | None) -> str | None:
    return None if values is None else ",".join(map(str, values))
