"""What is known of a session beside its samples."""

from __future__ import annotations

import numpy as np

from identify.estimation.session_facts import steady_command


def test_a_column_that_never_changes_is_known_by_its_value_and_another_is_not():
    command = np.column_stack([np.full(70_000, 2.5), np.zeros(70_000), np.zeros(70_000)])
    command[-1, 2] = 1e-9  # the last sample of all
    assert steady_command(command)[:2].tolist() == [2.5, 0.0]
    assert np.isnan(steady_command(command)[2])


def test_a_column_that_is_no_number_is_not_steady():
    assert np.isnan(steady_command(np.full((5, 1), np.nan)))
