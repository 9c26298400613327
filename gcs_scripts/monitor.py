"""A dashboard of one vehicle in the terminal, or one snapshot as text."""

import sys
import time
from collections.abc import Sequence
from typing import Annotated

import typer
from rich.columns import Columns
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text as Styled

from gcs_scripts.autopilot import Modes
from gcs_scripts.command_line import CONTEXT, Connect, Reach, System, Timeout, application, run
from gcs_scripts.connection import Vehicle, enum_name
from gcs_scripts.errors import ExitCode
from gcs_scripts.link_quality import Latency, LinkQuality
from gcs_scripts.status_text import Text
from gcs_scripts.vehicle_state import VehicleState
from gcs_scripts.wishes import ONCE, Wishes

__all__ = ["Monitor", "main"]

PROGRAM = "monitor"
REFRESH = 0.25  # [s]
TEXTS = 8  # shown
WISHES = {
    "SYS_STATUS": 1.0, "EXTENDED_SYS_STATE": 0.5, "ATTITUDE": 0.2, "GLOBAL_POSITION_INT": 0.2, "VFR_HUD": 0.25,
    "GPS_RAW_INT": 1.0, "MISSION_CURRENT": 1.0, "HOME_POSITION": ONCE,
}  # fmt: skip
TILT_INTERVAL = 0.25  # [s]
SNAPSHOT_WAIT = 5.0  # [s] that --once waits for messages that may not exist
UNITS = {
    "_kB_per_s": "kB/s", "_per_s": "/s", "_m_s": "m/s", "_ms": "ms", "_s": "s", "_m": "m", "_deg": "deg",
    "_percent": "%", "_V": "V", "_A": "A",
}  # fmt: skip
SEVERITY_STYLES = ("bold white on red", "bold red", "bold red", "red", "yellow", "cyan", "white", "dim")

_application = application()


class Monitor:
    """Watches one vehicle and the link to it."""

    def __init__(self, vehicle: Vehicle) -> None:
        """Begin to watch; messages that do not come by themselves are asked for."""
        self.vehicle = vehicle
        self.modes = Modes()
        self.state = VehicleState(vehicle, self.modes)
        self.quality = LinkQuality(time.monotonic())
        self.latency = Latency(vehicle)
        self._wishes = Wishes(vehicle, self.state, WISHES)
        vehicle.on_message += [self.quality.add, self._take]
        vehicle.request("AVAILABLE_MODES")

    def _take(self, message: object) -> None:
        now = time.monotonic()
        self.state.add(message, now)
        self.latency.add(message, now)

    def run(self, duration: float) -> None:
        """Watch for so long [s]. Raises LinkLostError when the vehicle has been silent for its timeout."""
        end = time.monotonic() + duration
        while (now := time.monotonic()) < end:
            self.latency.update(now)
            self.quality.update(now)
            if self.state.get("NAMED_VALUE_FLOAT TILT") is not None:  # only who has a wing that tilts has TILT_STATUS
                self._wishes.add("TILT_STATUS", TILT_INTERVAL)
            self._wishes.update(now)
            self.vehicle.listen(min(end - now, REFRESH))
            self.vehicle.check_alive()

    def is_complete(self) -> bool:
        """Whether everything wished for has come, and an answer that tells the latency."""
        return self.latency.last is not None and self._wishes.fulfilled()

    def close(self) -> None:
        """Leave the messages that were asked for to the vehicle's own rates again."""
        self._wishes.close()

    def sections(self) -> dict[str, dict[str, str]]:
        """Everything that is known: by section, texts by name."""
        now = time.monotonic()
        messages, size = self.quality.rates(now)
        link = {"messages_per_s": f"{messages:.0f}", "traffic_kB_per_s": f"{size * 1e-3:.1f}"}
        for system, share in sorted(self.quality.loss().items()):
            link[f"loss_system_{system}_percent"] = f"{100.0 * share:.1f}"
        if self.latency.least is not None:
            link["latency_ms"] = f"{1e3 * self.latency.least:.1f}"
        link["heartbeat_age_s"] = f"{now - self.vehicle.heard:.1f}"
        return self.state.sections(now) | {"link": link}


def snapshot(monitor: Monitor) -> str:
    """All that is known, one `name: value` a line, and the last texts."""
    lines = [f"{name}: {value}" for section in monitor.sections().values() for name, value in section.items()]
    lines += [f"text: {_severity(text)}: {text.text}" for text in list(monitor.vehicle.texts.kept)[-TEXTS:]]
    return "\n".join(lines)


def dashboard(monitor: Monitor) -> RenderableType:
    """The same as panels."""
    panels: list[Panel] = []
    for title, values in monitor.sections().items():
        table = Table.grid(padding=(0, 2))
        table.add_column(style="dim")
        table.add_column(justify="right")
        table.add_column(style="dim")
        for name, value in values.items():
            label, unit = _label(name)
            table.add_row(label, Styled(value, style=_style(name, value)), unit)
        panels.append(Panel(table if values else Styled("not told", style="dim"), title=title))
    texts = Styled("\n").join(
        Styled(f"{_severity(text):9} {text.text}", style=SEVERITY_STYLES[min(text.severity, 7)])
        for text in list(monitor.vehicle.texts.kept)[-TEXTS:]
    )
    return Group(Columns(panels, equal=True), Panel(texts, title="texts"))


def _label(name: str) -> tuple[str, str]:
    """Name for people and unit of a name that ends with its unit."""
    ending = next((ending for ending in UNITS if name.endswith(ending)), "")
    return name.removesuffix(ending).replace("_", " "), UNITS.get(ending, "")


def _style(name: str, value: str) -> str:
    if name == "armed":
        return "bold red" if value == "yes" else "green"
    if name.startswith("loss_") and float(value) > 1.0:
        return "bold yellow"
    return "bold"


def _severity(text: Text) -> str:
    return enum_name("MAV_SEVERITY", text.severity).lower()


@_application.command(name=PROGRAM, context_settings=CONTEXT)
def _command(
    once: Annotated[bool, typer.Option("--once", help="Print one snapshot, a `name: value` a line, and end.")] = False,
    link: Connect = None,
    timeout: Timeout = None,
    system: System = None,
) -> int:
    """Watch a vehicle: mode, attitude, altitude, airspeed, tilt, battery, mission, link quality; Ctrl-C ends it.

    Exit codes: 0 done, 2 wrong option, 4 no vehicle or link lost.
    """
    with Reach().but(link, timeout, system).open() as vehicle:
        monitor = Monitor(vehicle)
        try:
            if once:
                _wait_for_snapshot(monitor)
                print(snapshot(monitor))
            else:
                _show(monitor)
        finally:
            monitor.close()
    return ExitCode.DONE


def _wait_for_snapshot(monitor: Monitor) -> None:
    end = time.monotonic() + SNAPSHOT_WAIT
    while time.monotonic() < end and not monitor.is_complete():
        monitor.run(REFRESH)


def _show(monitor: Monitor) -> None:
    with Live(dashboard(monitor), console=Console(), screen=sys.stdout.isatty(), auto_refresh=False) as live:
        try:
            while True:
                monitor.run(REFRESH)
                live.update(dashboard(monitor), refresh=True)
        except KeyboardInterrupt:
            return


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    return run(_application, PROGRAM, arguments)


if __name__ == "__main__":
    sys.exit(main())
