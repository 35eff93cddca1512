"""Writing a session as text."""

from __future__ import annotations

import io

import numpy as np

from tests.plants.session_table import session_text


def test_the_text_is_what_numpy_writes():
    columns = [np.arange(5) * 1e-3, np.array([1.0, -2.5e-9, 3e17, 0.1, np.pi]), np.linspace(-1, 1, 5)]
    formats = ["%.6f", "%.9g", "%.7g"]
    written = io.StringIO()
    np.savetxt(written, np.column_stack(columns), formats, ",", header="t,q1,v1", comments="")
    assert session_text(columns, ["t", "q1", "v1"], formats) == written.getvalue()
