"""Passes over the samples are made by the executor that is chosen for a stretch of code."""

from __future__ import annotations

import pickle
import threading

import pytest

import identify
from identify.estimation.executor import SERIAL, chosen_executor, computed_by
from identify.estimation.record import Record


class Counting:
    """Calls in this process, and counts."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, function, items):
        self.calls += 1
        return SERIAL(function, items)


def test_without_a_choice_and_behind_its_end_sessions_are_reduced_here():
    counting = Counting()
    assert chosen_executor() is SERIAL
    with computed_by(counting), computed_by(SERIAL):
        assert chosen_executor() is SERIAL
    with pytest.raises(KeyError), computed_by(counting):
        raise KeyError
    assert chosen_executor() is SERIAL


def test_the_choice_of_one_thread_is_not_that_of_another():
    seen = []
    with computed_by(Counting()):
        thread = threading.Thread(target=lambda: seen.append(chosen_executor()))
        thread.start()
        thread.join()
    assert seen == [SERIAL]


@pytest.mark.parametrize("what", ["fit", "predictions", "validation"])
def test_every_pass_of_an_identification_is_made_by_the_chosen_executor(three_sessions, what):
    counting = Counting()
    with computed_by(counting):
        result = identify.identify(identify.load_experiment(three_sessions))
        fitting = counting.calls
        assert fitting > 0
        if what == "predictions":
            assert len(result.predictions) == 3
            assert counting.calls == fitting + 1
        if what == "validation":
            result.to_json()
            assert counting.calls > fitting


def test_a_record_that_is_sent_again_is_the_copy_that_is_there_with_what_it_holds(three_sessions):
    record = Record.of(identify.load_experiment(three_sessions))
    other = Record.of(identify.load_experiment(three_sessions))
    copy = pickle.loads(pickle.dumps(record))
    assert copy is not record
    assert not copy._held
    for _ in copy.blocks(copy.experiment.sessions[0]):
        pass
    assert record.rest_speed is not None  # found in between, and sent along
    again = pickle.loads(pickle.dumps(record))
    assert again is copy
    assert list(again._held) == [copy.experiment.sessions[0].file]
    assert (again.rest_speed == record.rest_speed).all()
    assert pickle.loads(pickle.dumps(other)) is not copy
    assert pickle.loads(pickle.dumps(record)) is not copy  # one record is held, the last
