"""Sessions reduced in several processes of this machine."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from functools import partial
from operator import neg

import pytest

import identify
from identify.estimation.executor import WorkerLost, computed_by
from identify.estimation.processes import Processes
from identify.recording import InputError
from tests.identify.estimation.same_document import assert_same

OWN_EFFECT = """
name: bump
explanation: A hump near the middle of the range. Check the gear.
columns: ["exp(-(q / width) ** 2)"]
unit: N m
constants:
  width: {from: 0.2, to: 0.6, count: 2}
"""


@pytest.fixture(scope="module")
def two():
    with Processes(2) as processes:
        yield processes


def test_results_come_in_the_order_of_the_items_from_other_processes(two):
    assert list(two(neg, range(7))) == [-item for item in range(7)]
    found = list(two(_process_of, range(6)))
    assert os.getpid() not in found
    assert len(set(found)) <= 2


def _process_of(item: object) -> int:
    return os.getpid()


@pytest.mark.parametrize("model", ["usual", "load-velocity"])
def test_identify_gives_the_same_document(three_sessions, two, model):
    experiment = identify.load_experiment(three_sessions)
    alone = identify.identify(experiment, model).to_json()
    with computed_by(two):
        assert_same(identify.identify(experiment, model).to_json(), alone)


def test_improve_gives_the_same_story_and_the_same_last_diagnosis(three_sessions, two):
    experiment = identify.load_experiment(three_sessions)
    alone = identify.improve(experiment)
    assert "elasticity" in [step["added"]["effect"] for step in alone.to_json()["steps"] if step["added"]]
    with computed_by(two):
        shared = identify.improve(experiment)
    assert_same(shared.to_json(), alone.to_json())
    assert_same(shared.diagnosis.to_json(), alone.diagnosis.to_json())


def test_next_gives_the_same_proposals(three_sessions, two):
    from identify.diagnosis.next_experiment import next_experiment

    def plan():
        experiment = identify.load_experiment(three_sessions)
        return next_experiment(experiment, rivals=["elasticity", "backlash"]).to_json()

    alone = plan()
    assert len(alone["proposals"]) == 5
    with computed_by(two):
        assert_same(plan(), alone)


def test_the_user_s_own_effect_goes_along(three_sessions, two, tmp_path):
    folder = tmp_path / "own"
    folder.mkdir()
    for file in three_sessions.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    (folder / "bump.yaml").write_text(OWN_EFFECT)
    with (folder / "experiment.yaml").open("a") as stream:
        stream.write("effects: [bump.yaml]\n")
    experiment = identify.load_experiment(folder)
    alone = identify.identify(experiment, add=["bump"]).to_json()
    with computed_by(two):
        assert_same(identify.identify(experiment, add=["bump"]).to_json(), alone)


def test_what_a_function_raises_in_a_process_is_raised_here(two):
    with pytest.raises(InputError, match="session 3 is wrong"):
        list(two(_wrong, [3]))
    assert list(two(neg, [1])) == [-1]


def _wrong(item: int) -> None:
    raise InputError(f"session {item} is wrong")


def test_a_result_that_cannot_be_sent_is_an_error_not_a_wait(two):
    with pytest.raises(RuntimeError, match="cannot be sent"):
        list(two(_unsendable, [1]))


def _unsendable(item: int) -> object:
    return lambda: item


def _killed_once(marker: str, item: int) -> int:
    if item == 2 and not os.path.exists(marker):
        with open(marker, "w"):
            os.kill(os.getpid(), signal.SIGKILL)
    return -item


def test_what_was_under_way_in_a_killed_process_is_computed_again(two, tmp_path):
    marker = str(tmp_path / "killed")
    assert list(two(partial(_killed_once, marker), range(5))) == [0, -1, -2, -3, -4]
    assert os.path.exists(marker)


def test_an_item_that_kills_every_process_is_given_up(two):
    with pytest.raises(WorkerLost, match="3 processes ended at 7"):
        list(two(_always_killed, [7]))
    assert list(two(neg, [1])) == [-1]


def _always_killed(item: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_process_killed_between_two_passes_changes_nothing(three_sessions):
    experiment = identify.load_experiment(three_sessions)
    alone = identify.identify(experiment).to_json()
    with Processes(2) as processes, computed_by(_killing(processes)):
        assert_same(identify.identify(experiment).to_json(), alone)


def _killing(processes: Processes):
    """The executor, one of whose processes is killed before each pass but the first."""

    def call(function, items):
        running = [worker for worker in processes._processes if worker is not None]
        if running:
            running[0].process.kill()
        return processes(function, items)

    return call


def test_processes_end_with_the_block_and_start_again_when_asked():
    with Processes(2) as processes:
        first = list(processes(_process_of, range(4)))
        workers = [worker.process for worker in processes._processes if worker is not None]
    assert all(worker.poll() is not None for worker in workers)
    assert list(processes(_process_of, [0])) != first[:1]  # started anew
    processes.close()


def test_processes_end_when_their_parent_is_killed(tmp_path):
    """The parent prints its workers' ids and then hangs; killed, it leaves nobody behind."""
    program = """
import os, signal
from identify.estimation.processes import Processes
from tests.identify.estimation.test_processes import _process_of
processes = Processes(2)
print(*list(processes(_process_of, range(2))), flush=True)
signal.pause()
"""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, env=environment
    ) as parent:
        assert parent.stdout is not None
        workers = [os.pidfd_open(int(pid)) for pid in parent.stdout.readline().split()]
        parent.kill()
    for worker in workers:
        ended, _, _ = select.select([worker], [], [], 30.0)  # readable once the process has ended
        os.close(worker)
        assert ended
