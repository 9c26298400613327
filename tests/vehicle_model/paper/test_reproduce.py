"""The page and its figures: all written, all shown, the same bytes again, and honest about what is not met."""

from pathlib import Path

import pytest

from vehicle_model.aircraft import Aircraft, load_aircraft
from vehicle_model.paper import reproduce
from vehicle_model.paper.results import compute
from vehicle_model.paper.targets import targets

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return load_aircraft()


@pytest.fixture(scope="module")
def written(aircraft: Aircraft, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return reproduce(aircraft, tmp_path_factory.mktemp("paper") / "new" / "folder")


def test_the_page_shows_every_figure_and_no_other(written: list[Path]) -> None:
    *figures, page = written
    text = page.read_text(encoding="utf-8")
    shown = [line.split("](")[1].rstrip(")") for line in text.splitlines() if line.startswith("![")]
    assert sorted(shown) == sorted(figure.name for figure in figures)
    assert page.name == "README.md"


def test_figures_are_png_small_enough_for_a_repository(written: list[Path]) -> None:
    for figure in written[:-1]:
        content = figure.read_bytes()
        assert content.startswith(PNG_SIGNATURE)
        assert len(content) < 120_000, figure.name


def test_figures_carry_no_metadata(written: list[Path]) -> None:
    for figure in written[:-1]:
        content = figure.read_bytes()
        assert b"tEXt" not in content
        assert b"tIME" not in content


def test_every_number_on_the_page_is_a_number(written: list[Path]) -> None:
    words = written[-1].read_text(encoding="utf-8").replace("|", " ").split()
    assert not {"nan", "inf", "-inf", "None"} & set(words)


def test_the_same_aircraft_gives_the_same_bytes(aircraft: Aircraft, written: list[Path], tmp_path: Path) -> None:
    again = reproduce(aircraft, tmp_path)
    assert [path.name for path in again] == [path.name for path in written]
    for first, second in zip(written, again, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.name


def test_an_aircraft_with_more_inertia_misses_the_short_period_and_the_page_says_so(
    aircraft: Aircraft, tmp_path: Path
) -> None:
    sluggish = aircraft.with_values({"mass_properties.iyy": 1.3 * aircraft.mass_properties.iyy})
    missed = [target.name for target in targets(compute(sluggish)) if not target.met]
    assert missed == ["short period, real part", "short period, imaginary part"]
    text = reproduce(sluggish, tmp_path)[-1].read_text(encoding="utf-8")
    assert f"Not met: {'; '.join(missed)}." in text
