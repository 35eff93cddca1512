"""What a plot of two columns is thinned to keeps every extreme."""

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from api.service.pair_thinning import thinned_pairs


@given(
    values=arrays(
        np.float64, st.tuples(st.just(2), st.integers(0, 300)), elements=st.floats(allow_infinity=False)
    ),
    cells=st.tuples(st.integers(1, 30), st.integers(1, 30)),
)
@example(values=np.array([[5e-324, 0.0], [0.0, 0.0]]), cells=(1, 1))
@example(values=np.array([[1.7e308, -1.7e308], [0.0, 0.0]]), cells=(3, 1))
def test_extremes_stay_and_every_occupied_cell_has_a_sample(values, cells) -> None:
    across, up = cells
    kept = thinned_pairs(values[0], values[1], across, up)
    finite = np.isfinite(values).all(axis=0)
    assert finite[kept.rows].all()
    assert len(kept.rows) <= across * up + 2 * (across + up)
    if finite.any():
        for column in values:
            assert column[kept.rows].min() == column[finite].min()
            assert column[kept.rows].max() == column[finite].max()
    else:
        assert not len(kept.rows)


def test_dense_cells_are_thinned_and_say_how_many_they_hold() -> None:
    x, y = np.random.default_rng(1).normal(size=(2, 50_000))
    kept = thinned_pairs(x, y, 40, 40)
    assert len(kept.rows) < 1800
    assert kept.count.max() > 100
    alone = np.append(x, 9.0), np.append(y, -9.0)
    assert 50_000 in thinned_pairs(*alone, 40, 40).rows
