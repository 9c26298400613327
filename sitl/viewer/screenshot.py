"""A picture of a recording, without a display: `python -m sitl.viewer.screenshot FLIGHT.rrd PICTURE.png --time 12`.

Needs a Vulkan driver; on a machine without a graphics card Mesa's software one will do (Debian: mesa-vulkan-drivers).
"""

import os
import time
from pathlib import Path
from typing import Annotated

import typer

os.environ["CI"] = "1"  # no usage reports from the viewer that this starts
os.environ.setdefault("RUST_LOG", "error")
os.environ.setdefault("WGPU_BACKEND", "vulkan")

__all__ = ["screenshot"]

LOAD_DEADLINE = 30.0  # s of wall time
RENDER_SECONDS = 2.0  # the first frames compile shaders and place the camera


def screenshot(recording: Path, picture: Path, sim_time: float | None = None) -> None:
    """Open a recording in a headless viewer, go to a simulated time [s] (its end if None) and save what it shows.

    Raises FileNotFoundError without the recording, TimeoutError when the viewer does not load it.
    """
    import warnings

    from rerun.experimental import ViewerClient

    from sitl.viewer.web import rerun_binary, unused_port

    if not recording.is_file():
        msg = f"{recording}: expected a recording (.rrd)"
        raise FileNotFoundError(msg)
    warnings.simplefilter("ignore")  # the client API calls itself experimental
    with ViewerClient.spawn(headless=True, port=unused_port(), executable_path=rerun_binary()) as viewer:
        viewer.open(str(recording.absolute()))
        end = time.monotonic() + LOAD_DEADLINE
        while True:
            state = viewer.get_state()
            lines = [line for r in state.recordings for line in r.timelines if line.name == "sim_time" and line.end]
            if lines and not state.loading:
                break
            if time.monotonic() > end:
                msg = f"{recording}: the viewer did not load it within {LOAD_DEADLINE:g} s"
                raise TimeoutError(msg)
            time.sleep(0.1)
        last = (lines[0].end or 0) * 1e-9
        viewer.set_time("sim_time", duration=last if sim_time is None else min(sim_time, last), play_state="paused")
        time.sleep(RENDER_SECONDS)
        viewer.save_screenshot(str(picture.absolute()))


def _command(
    recording: Annotated[Path, typer.Argument(help="Recording (.rrd).")],
    picture: Annotated[Path, typer.Argument(help="PNG file to write.")],
    sim_time: Annotated[float | None, typer.Option("--time", help="Simulated time [s]; the end by default.")] = None,
) -> None:
    """Picture of a recording at a moment of the flight."""
    screenshot(recording, picture, sim_time)


if __name__ == "__main__":
    typer.run(_command)
