"""The sink rates that the laws allow themselves against searches that do not know the force map."""

import numpy as np

from sitl.control.sinking import certified_sink, planned_sink, sinking_words, trimmed_sink
from tests.sitl.control.flown import aircraft, design

SPEEDS = np.array([9.0, 11.0, 12.0, 13.0, 14.0, 15.5])


def test_the_laws_sink_as_fast_as_the_wing_bears_with_its_flaps() -> None:
    found = certified_sink(aircraft(), SPEEDS, flaps=True)
    np.testing.assert_allclose(planned_sink(design(), SPEEDS), found, atol=0.45)
    assert (found[2:5] < 2.0).all()  # no 2 m/s in mid transition


def test_six_balanced_axes_agree_where_the_flaps_rest() -> None:
    trimmed, searched = trimmed_sink(aircraft(), SPEEDS), certified_sink(aircraft(), SPEEDS, flaps=False)
    np.testing.assert_allclose(trimmed, searched, atol=0.25)
    assert (trimmed[2:5] < 0.5).all()  # it is the flaps that let it sink


def test_words_name_the_least() -> None:
    assert "1.5 m/s (somehow, at 12.0 m/s)" in sinking_words(SPEEDS, [("somehow", np.array([3.0, 2, 1.5, 1.6, 2, 3]))])
