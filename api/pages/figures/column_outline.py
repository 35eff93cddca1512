"""A column of a record in small: its smallest and largest values from the first sample to the last."""

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import Scale, curve, padded_range, picture
from api.service.record_documents import RecordColumn

WIDTH, HEIGHT = 160.0, 34.0


def column_outline(column: RecordColumn) -> Markup:
    """The outline as a small plot without axes; empty for a column of words."""
    if column.smallest is None or column.largest is None:
        return Markup("")
    values = np.array([np.nan if value is None else value for value in column.outline])
    low, high = padded_range(values[np.isfinite(values)])
    across = Scale(0, max(len(values) - 1, 1), 1, WIDTH - 1).array(np.arange(len(values)))
    down = Scale(low, high, HEIGHT - 1, 1).array(values)
    title = f"{column.name}: from {column.smallest:.6g} to {column.largest:.6g}"
    return picture(WIDTH, HEIGHT, title, curve(across, down, "curve measured"))
