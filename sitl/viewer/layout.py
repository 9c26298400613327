"""How the viewer is laid out at first sight: the scene beside the curves, map and messages below."""

import rerun as rr
import rerun.blueprint as rrb

from sitl.viewer.plots import PLOTS

__all__ = ["TRAIL_SECONDS", "blueprint"]

TRAIL_SECONDS = 60.0
CAMERA = (-4.2, -3.2, -2.2)  # behind, to the left and above, NED [m]


def _last(seconds: float) -> list[rrb.VisibleTimeRange]:
    """The last so many seconds before the cursor, on either timeline."""
    start = rrb.TimeRangeBoundary.cursor_relative(seconds=-seconds)
    end = rrb.TimeRangeBoundary.cursor_relative()
    return [rrb.VisibleTimeRange(timeline, start=start, end=end) for timeline in ("sim_time", "wall_time")]


def _scene() -> rrb.Spatial3DView:
    return rrb.Spatial3DView(
        name="Flight",
        origin="world",
        line_grid=rrb.LineGrid3D(visible=True, spacing=5.0, stroke_width=1.0, color=(120, 130, 140, 110)),
        background=rrb.Background(color=(28, 32, 38)),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=CAMERA, look_target=(0.0, 0.0, 0.0), tracking_entity="world/aircraft"
        ),
        overrides={"world/trail": [rrb.VisibleTimeRanges(_last(TRAIL_SECONDS))]},
    )


def blueprint(*, show_map: bool) -> rrb.Blueprint:
    """The default layout, with or without the map, which fetches its tiles from the internet."""
    plots = [
        rrb.TimeSeriesView(name=plot.title, origin=plot.path, plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop))
        for plot in PLOTS
    ]
    below: list[rrb.View] = [rrb.TextDocumentView(name="Key", origin="key")]
    if show_map:
        below.append(rrb.MapView(name="Map", origin="map", zoom=16.0, background=rrb.MapProvider.OpenStreetMap))
    below.append(rrb.TextLogView(name="Messages", origin="messages"))
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_scene(), rrb.Horizontal(*below), row_shares=[4, 1]),
            rrb.Grid(*plots, grid_columns=2),
            column_shares=[5, 4],
        ),
        rrb.TimePanel(state=rrb.PanelState.Collapsed, timeline="sim_time", play_state=rr.blueprint.components.PlayState.Following),
        rrb.SelectionPanel(state=rrb.PanelState.Hidden),
        rrb.BlueprintPanel(state=rrb.PanelState.Collapsed),
        auto_views=False,
    )
