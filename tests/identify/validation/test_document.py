"""What a document says of sessions, against the predictions that the same identification gives."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.validation.document import session_squares


def test_the_squares_of_a_session_are_those_of_its_predictions(tx40):
    """Six joints, one session of each role: over all joints, moving samples only."""
    result = identify.identify(identify.load_experiment(tx40))
    found = session_squares(result)
    assert set(found) == {entry.file for entry in result.experiment.sessions}
    for entry in result.experiment.sessions:
        parts = [result.prediction(entry.file, joint) for joint in result.fitted.record.joint_names]
        residual = np.concatenate([part.residual[part.moving] for part in parts])
        measured = np.concatenate([part.measured[part.moving] for part in parts])
        assert found[entry.file] == pytest.approx([residual @ residual, measured @ measured], rel=1e-6)
