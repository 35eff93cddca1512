"""Any two columns against each other: what is seen, and what is sent of it."""

import json
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from api.pages.column_plot import Seen, pairs

X = np.array([-1.0, 0.0, 1.0, 2.0, np.nan])
Y = np.array([10.0, 20.0, 30.0, 40.0, 50.0])


@pytest.mark.parametrize(
    ("seen", "kept"),
    [
        (Seen(), [0, 1, 2, 3]),
        (Seen(x_from=0.0), [1, 2, 3]),
        (Seen(x_to=1.0), [0, 1, 2]),
        (Seen(y_from=20.0, y_to=30.0), [1, 2]),
        (Seen(x_from=0.0, y_to=20.0), [1]),
        (Seen(x_from=0.5, x_to=0.6), []),
    ],
)
def test_the_ends_of_a_range_are_seen(seen, kept):
    x, y = seen.of(X, Y)
    assert np.flatnonzero(np.isfinite(x) & np.isfinite(y)).tolist() == kept
    assert x[kept].tolist() == X[kept].tolist()
    assert y[kept].tolist() == Y[kept].tolist()


@dataclass
class Named:
    name: str


def shown(x, y, chosen):
    """A model's samples, as the page's address chose them."""
    columns = {"x": x, "y": y}
    samples = SimpleNamespace(
        time=np.arange(len(x)) / 10.0, session=np.arange(len(x)) % 2, files=("a.csv", "b.csv")
    )
    return SimpleNamespace(
        columns=SimpleNamespace(column=Named, in_fit=columns.__getitem__),
        stored=SimpleNamespace(samples=lambda *of: SimpleNamespace(in_fit=samples)),
        model=None,
        joint=None,
        counted=None,
        chosen_of_fit=lambda: np.isin(np.arange(len(x)), chosen),
    )


def sent(answer):
    """The header, and the six rows."""
    rows, points = np.frombuffer(answer.body[:8], "<u4")
    table = np.frombuffer(answer.body[8:], "<f4").reshape(rows, points)
    return json.loads(answer.headers["X-Pairs"]), table


def test_few_samples_are_sent_as_they_are_with_their_session_and_whether_they_are_chosen():
    header, table = sent(pairs(shown(X, Y, [2]), "x", "y", Seen(), 160, 100))
    order = np.argsort(table[0])
    x, y, time, session, count, chosen = table[:, order]
    assert x.tolist() == X[:4].tolist()
    assert y.tolist() == Y[:4].tolist()
    assert time == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert session.tolist() == [0, 1, 0, 1]
    assert count.tolist() == [1, 1, 1, 1]
    assert chosen.tolist() == [0, 0, 1, 0]
    assert header == {
        "x": {"name": "x"},
        "y": {"name": "y"},
        "files": ["a.csv", "b.csv"],
        "samples": 4,
        "seen": 4,
    }


def test_a_range_is_seen_of_all_that_there_are():
    header, table = sent(pairs(shown(X, Y, []), "x", "y", Seen(x_from=0.5), 160, 100))
    assert (header["samples"], header["seen"]) == (4, 2)
    assert sorted(table[0]) == [1.0, 2.0]


def test_chosen_samples_are_counted_by_themselves_and_none_of_their_extremes_is_lost():
    random = np.random.default_rng(5)
    x, y = random.normal(size=(2, 50_000))
    chosen = np.arange(0, 50_000, 10)
    _, table = sent(pairs(shown(x, y, chosen), "x", "y", Seen(), 20, 20))
    kept = table[:2, table[5] == 1]
    assert 5000 > kept.shape[1] > 100
    for row, values in enumerate((x, y)):
        assert kept[row].max() == np.float32(values[chosen].max())
        assert kept[row].min() == np.float32(values[chosen].min())
    assert set(kept[0]) <= set(x[chosen].astype(np.float32))
    assert table[4, table[5] == 1].max() < table[4].max()
