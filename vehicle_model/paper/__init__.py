"""The paper, reproduced: its figures and Table 1 from our aircraft, and a page that discusses them.

Run as `python -m vehicle_model paper --out docs/paper`.
"""

from pathlib import Path

from vehicle_model.aircraft import Aircraft

__all__ = ["reproduce"]


def reproduce(aircraft: Aircraft, out: Path) -> list[Path]:
    """Write the figures (PNG) and the page (README.md) into a folder, made if need be; returns the files.

    The same aircraft gives the same bytes. Raises TrimError where the aircraft has no level trim at 0..30 m/s.
    """
    from vehicle_model.paper import figures_of_the_paper, further_figures  # matplotlib is slow to import
    from vehicle_model.paper.page import FIGURES, page
    from vehicle_model.paper.results import compute
    from vehicle_model.paper.style import paper_style

    results = compute(aircraft)
    out.mkdir(parents=True, exist_ok=True)
    drawings = (
        figures_of_the_paper.draw_coefficients,
        figures_of_the_paper.draw_trim,
        figures_of_the_paper.draw_step,
        figures_of_the_paper.draw_poles,
        further_figures.draw_power_and_stall,
        further_figures.draw_moments,
        further_figures.draw_descents,
        further_figures.draw_slipstreams,
    )
    with paper_style():
        written = [draw(results, out / name) for draw, name in zip(drawings, FIGURES, strict=True)]
    text = out / "README.md"
    text.write_text(page(results), encoding="utf-8", newline="\n")
    return [*written, text]
