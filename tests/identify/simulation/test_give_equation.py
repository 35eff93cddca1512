"""The torque equation with links behind their motors, where these do not give: it is that of a rigid transmission."""

from __future__ import annotations

import numpy as np
import pytest

from identify import load_experiment
from identify.effects.give import Give
from identify.estimation.decimated_rows import decimated_rows
from identify.identification import identify
from identify.simulation.driven_link import DrivenLink
from identify.simulation.give_equation import GiveEquation, Stretch
from tests.plants import two_masses


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A rigid model of two sessions of a joint whose link hangs on a spring."""
    recorded = two_masses.record(two_masses.TwoMasses(), (0.0, 4.0, 2.0), (4.0, 8.0, 6.0), 4.0, 3)
    folder = two_masses.write_experiment(tmp_path_factory.mktemp("equation") / "bench", recorded)
    return identify(load_experiment(folder), "usual").fitted


def equation_of(fitted):
    """All samples of the fit, with a link of 8 kg m² that a torque drives and nothing else."""
    listed = []
    for entry in fitted.entries:
        blocks = fitted.record.blocks(entry)
        rows = decimated_rows(fitted.record, entry, fitted.slots, fitted.load_from)
        for prepared, part in zip(blocks, rows, strict=True):
            block = prepared.block
            still = np.zeros(len(block.time))
            load, whole = 10.0 * np.sin(3.0 * block.time), np.full((len(still), 1), 12.0)
            link = DrivenLink(0, block.sampling_period, still, still, load, 0.0 * whole, whole)
            listed.append((Stretch(block, slice(0, len(still)), [link], part.moving), part))
    return GiveEquation(fitted, fitted.fit.fitted, listed)


def test_what_a_link_that_does_not_give_leaves_of_the_torque_is_what_the_fit_left(fitted):
    equation, stiff = equation_of(fitted), [Give(4.0, gap=1e-7, flank_load=0.1)]
    left = fitted.fit.residual / np.sqrt(fitted.fit.rows)
    np.testing.assert_allclose(equation.deviations(stiff), left, rtol=0.02)
    np.testing.assert_allclose(
        equation.linear(stiff), fitted.fit.chi[fitted.fit.fitted], atol=0.02 * np.max(np.abs(fitted.fit.chi))
    )
    assert equation.seconds == pytest.approx(8.0, rel=0.05)


def test_what_is_not_in_the_record_adds_to_what_is_left(fitted):
    """A wide gap that its link flies across, which the motor of this record never felt."""
    equation = equation_of(fitted)
    narrow, wide = (
        np.linalg.norm(equation.residual([Give(4.0, gap=gap, flank_load=0.1)])) for gap in (1e-7, 0.05)
    )
    assert wide > 1.05 * narrow
