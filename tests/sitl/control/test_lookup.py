"""Interpolation: exact at the nodes, linear between them, and the ends beyond the ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.lookup import map_lookup, schedule_lookup

AXES = np.array([[-4.0, 2.0, 5.0], [-3.0, 3.0, 3.0], [-1.5, 1.5, 4.0], [-12.0, 4.0, 4.0]])
COUNTS = tuple(int(count) for count in AXES[:, 2])
RANDOM = np.random.default_rng(3)
TABLE = RANDOM.normal(size=(*COUNTS, 3))
SCHEDULE = RANDOM.normal(size=(COUNTS[0], 2))
LAST = AXES[:, 0] + AXES[:, 1] * (AXES[:, 2] - 1.0)

inside = st.tuples(*(st.floats(float(low), float(high)) for low, high in zip(AXES[:, 0], LAST, strict=True)))
anywhere = st.tuples(*(st.floats(-50.0, 50.0) for _ in range(4)))


def looked_up(table: np.ndarray, point: np.ndarray) -> np.ndarray:
    node = np.full(table.shape[-1], np.nan)
    u, w, force_x, force_z = (float(value) for value in point)
    map_lookup(table, AXES, u, w, force_x, force_z, node)
    return node


def test_every_node_of_the_map_is_given_back() -> None:
    for index in np.ndindex(*COUNTS):
        found = looked_up(TABLE, AXES[:, 0] + AXES[:, 1] * index)
        np.testing.assert_allclose(found, TABLE[index], rtol=1e-13, atol=1e-13)


@given(inside)
def test_a_function_linear_in_each_coordinate_is_reproduced_between_the_nodes(point: tuple[float, ...]) -> None:
    def function(u, w, x, z):
        return np.stack([2.0 + 3.0 * u - w + 0.5 * x + 4.0 * z, u * w * x * z, u * w - x * z], axis=-1)

    nodes = [first + step * np.arange(count) for first, step, count in AXES]
    table = function(*np.meshgrid(*nodes, indexing="ij"))
    np.testing.assert_allclose(looked_up(table, np.array(point)), function(*point), rtol=1e-9, atol=1e-9)


@given(anywhere)
def test_beyond_its_ends_the_map_is_that_of_the_ends(point: tuple[float, ...]) -> None:
    ends = np.clip(point, AXES[:, 0], LAST)
    np.testing.assert_array_equal(looked_up(TABLE, np.array(point)), looked_up(TABLE, ends))


@given(st.floats(-50.0, 50.0))
def test_the_schedule_is_numpys_linear_interpolation(airflow: float) -> None:
    row = np.full(2, np.nan)
    schedule_lookup(SCHEDULE, AXES, airflow, row)
    nodes = AXES[0, 0] + AXES[0, 1] * np.arange(COUNTS[0])
    assert row == pytest.approx([np.interp(airflow, nodes, SCHEDULE[:, k]) for k in range(2)], rel=1e-12, abs=1e-12)
