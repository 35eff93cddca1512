"""What is not known of the instants of reversal is no effect: loops whose encoder does not show how the joint turns."""

import numpy as np
import pytest

import identify
from identify.diagnosis.screening import Screening
from identify.diagnosis.turning import deviation_of_instants
from identify.estimation.fitting import fit_model
from identify.estimation.requested_model import open_record, requested_model
from tests.blind.loops import draw_loop, with_effects
from tests.plants.closed_loop import simulate, write_arm


@pytest.fixture(scope="module")
def loops(tmp_path_factory):
    """A machine with nothing hidden that was said to have a delay of 1.3 ms, and the same with one of 15 ms."""
    arm = draw_loop(7001, 21).arm
    arms = {"nothing": arm, "delay": with_effects(arm, {"delay": 0.015})}
    made = simulate(list(arms.values()))
    folder = tmp_path_factory.mktemp("loops")
    return {
        name: identify.load_experiment(write_arm(folder / name, each, sessions))
        for (name, each), sessions in zip(arms.items(), made, strict=True)
    }


def screened(experiment):
    record = open_record(experiment, "usual")
    return Screening.of(fit_model(record, requested_model(record, "usual", ())))


def test_friction_that_turns_late_within_what_is_known_of_the_instants_is_not_called_a_delay(loops):
    said = identify.diagnose(loops["nothing"]).document().joints[0]
    assert (said.verdict, tuple(said.missing)) == ("adequate", ())


def test_only_so_late_as_the_instants_leave_room_for(loops):
    room = {name: screened(experiment) for name, experiment in loops.items()}
    assert all(0.0 < deviation_of_instants(each.fitted, 0) < 0.002 for each in room.values())
    assert [len(room[name].selection.turning[0]) for name in ("nothing", "delay")] == [1, 0]


def test_nobody_explains_what_is_not_known_of_the_instants(loops):
    selection = screened(loops["nothing"]).selection
    (turning,) = selection.turning
    best = selection.findings(0)[0]
    model = selection.motion.alone(0, selection.base())
    assert best.before.total < 0.95 * model.total
    assert best.before.total == pytest.approx(
        selection.motion.alone(0, np.union1d(selection.base(), turning)).total
    )
