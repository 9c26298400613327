"""How the viewer is laid out at first sight: the scene beside the curves, map and messages below."""

import rerun.blueprint as rrb
from rerun.blueprint.components import PlayState

from sitl.viewer.plots import PLOTS
from sitl.viewer.scene import FOLLOWED

__all__ = ["TRAIL_SECONDS", "blueprint"]

TRAIL_SECONDS = 60.0
CAMERA = (-1.55, -1.15, -0.75)  # from the aircraft: behind, to the left and above, NED, in aircraft sizes


def _last(seconds: float) -> list[rrb.VisibleTimeRange]:
    """The last so many seconds before the cursor, on either timeline."""
    start = rrb.TimeRangeBoundary.cursor_relative(seconds=-seconds)
    end = rrb.TimeRangeBoundary.cursor_relative()
    return [rrb.VisibleTimeRange(timeline, start=start, end=end) for timeline in ("sim_time", "wall_time")]


def _scene(size: float) -> rrb.Spatial3DView:
    return rrb.Spatial3DView(
        name="Flight",
        origin="world",
        line_grid=rrb.LineGrid3D(visible=True, spacing=5.0, stroke_width=1.0, color=(120, 130, 140, 110)),
        background=rrb.Background(color=(28, 32, 38)),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=[size * part for part in CAMERA],
            look_target=(0.0, 0.0, 0.0),
            tracking_entity=FOLLOWED,
        ),
        overrides={"world/trail": [rrb.VisibleTimeRanges(_last(TRAIL_SECONDS))]},
    )


def blueprint(size: float, *, show_map: bool) -> rrb.Blueprint:
    """The default layout for an aircraft of a size [m], with or without the map, whose tiles come from the internet."""
    plots = [
        rrb.TimeSeriesView(name=plot.title, origin=plot.path, plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop))
        for plot in PLOTS
    ]
    below: list[rrb.View] = [rrb.TextDocumentView(name="Key", origin="key")]
    if show_map:
        below.append(rrb.MapView(name="Map", origin="map", zoom=16.0, background=rrb.MapProvider.OpenStreetMap))
    columns = rrb.TextLogColumns(text_log_columns=["loglevel", "body"])
    below.append(rrb.TextLogView(name="Messages", origin="messages", columns=columns))
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_scene(size), rrb.Horizontal(*below), row_shares=[4, 1]),
            rrb.Grid(*plots, grid_columns=2),
            column_shares=[5, 4],
        ),
        rrb.TimePanel(state=rrb.PanelState.Collapsed, timeline="sim_time", play_state=PlayState.Following),
        rrb.SelectionPanel(state=rrb.PanelState.Hidden),
        rrb.BlueprintPanel(state=rrb.PanelState.Collapsed),
        auto_views=False,
    )
