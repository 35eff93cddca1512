"""The small plot of a column shows its values and says them to a screen reader."""

import re

import numpy as np

from api.pages.figures.column_outline import column_outline
from api.service.record_documents import RecordColumn
from tests.api.pages.path_points import points_of


def column(outline, smallest=-2.0, largest=3.0):
    return RecordColumn(
        name="Lage <1>", unit="deg", samples=4, smallest=smallest, largest=largest, first="", outline=outline
    )


def test_values_are_drawn_and_said():
    picture = column_outline(column([-2.0, 3.0, 1.0, 0.0]))
    assert 'aria-label="Lage &lt;1&gt;: from -2 to 3"' in picture
    data = re.search(r' d="([^"]+)"', picture)
    assert data is not None
    assert np.sign(np.diff(points_of(data[1])[:, 1])).tolist() == [-1, 1, 1]  # upwards on the screen first


def test_a_gap_breaks_the_curve():
    assert column_outline(column([-2.0, 1.0, None, 3.0, 2.0])).count("M") == 2


def test_words_have_no_plot():
    assert column_outline(column([], None, None)) == ""
