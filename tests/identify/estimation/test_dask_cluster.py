"""Sessions reduced on a real Dask cluster of this machine, workers in processes of their own."""

from __future__ import annotations

import os
import signal
from operator import neg

import pytest

import identify
from identify.estimation.dask_cluster import Dask
from identify.estimation.executor import WorkerLost, computed_by
from identify.recording import InputError
from tests.identify.estimation.same_document import assert_same

distributed = pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
dask_config = pytest.importorskip("dask.config")


pytestmark = pytest.mark.timeout(120)


def local_cluster(workers: int):
    """A scheduler in this process, workers in others, on free ports."""
    return distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, dashboard_address=":0", silence_logs=50
    )


@pytest.fixture(scope="module")
def cluster():
    with local_cluster(2) as running:
        yield running


def test_diagnose_gives_the_same_document(three_sessions, cluster):
    experiment = identify.load_experiment(three_sessions)
    alone = identify.diagnose(experiment).to_json()
    with Dask(cluster.scheduler_address) as dask, computed_by(dask):
        assert_same(identify.diagnose(experiment).to_json(), alone)


def test_a_worker_killed_in_between_changes_nothing(three_sessions, cluster):
    experiment = identify.load_experiment(three_sessions)
    alone = identify.identify(experiment).to_json()
    killed = []

    with Dask(cluster.scheduler_address) as dask:

        def with_a_kill(function, items):
            found = dask(function, items)
            for number, one in enumerate(found):
                if number == 0 and len(items) > 1 and not killed:
                    killed.append(_busy_worker(dask.client))
                    os.kill(killed[0], signal.SIGKILL)
                yield one

        with computed_by(with_a_kill):
            assert_same(identify.identify(experiment).to_json(), alone)
    assert len(killed) == 1


def _busy_worker(client: distributed.Client) -> int:
    """Process of a worker that has sessions to reduce or has some results; any if all are done already."""
    pids = client.run(os.getpid)
    processing = client.processing()
    busy = [address for address in pids if processing.get(address)]
    return pids[(busy or list(pids))[0]]


def test_an_item_that_kills_its_workers_is_an_error():
    """Here at the first worker; a scheduler tries four unless it is set otherwise."""
    with (
        dask_config.set({"distributed.scheduler.allowed-failures": 0}),
        local_cluster(1) as cluster,
        Dask(cluster.scheduler_address) as dask,
        pytest.raises(WorkerLost, match="repeatedly at 7"),
    ):
        list(dask(_always_killed, [7]))


def test_a_cluster_that_has_lost_all_workers_is_an_error_not_a_wait(monkeypatch):
    monkeypatch.setattr("identify.estimation.dask_cluster.WITHOUT_WORKERS", 0.0)
    with (
        local_cluster(1) as cluster,
        Dask(cluster.scheduler_address) as dask,
    ):
        assert list(dask(neg, [1])) == [-1]
        cluster.scale(0)
        with pytest.raises(WorkerLost, match="no worker"):
            list(dask(neg, range(3)))


def test_a_cluster_that_has_lost_all_workers_before_it_is_asked_is_an_error_too(monkeypatch):
    monkeypatch.setattr("identify.estimation.dask_cluster.WITHOUT_WORKERS", 0.0)
    with (
        local_cluster(0) as empty,
        distributed.Client(empty) as client,
        pytest.raises(WorkerLost, match="no worker"),
    ):
        list(Dask(client)(neg, range(3)))


def _always_killed(item: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_what_a_function_raises_on_a_worker_is_raised_here(cluster):
    with distributed.Client(cluster) as client:
        with pytest.raises(InputError, match="session 3 is wrong"):
            list(Dask(client)(_wrong, [3]))
        with pytest.raises(TimeoutError, match="its own"):
            list(Dask(client)(_late, [3]))
        assert list(Dask(client)(neg, [1, 2])) == [-1, -2]


def _wrong(item: int) -> None:
    raise InputError(f"session {item} is wrong")


def _late(item: int) -> None:
    raise TimeoutError("its own")


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("localhost:1", "no scheduler answers there"),
        ("foo://", "unknown address scheme"),
        ("", "missing port"),
    ],
)
def test_a_wrong_address_is_said_in_one_line(address, words):
    with pytest.raises(InputError, match=words) as told, Dask(address) as dask:
        list(dask(neg, [1]))
    assert "\n" not in str(told.value)
    assert str(told.value).startswith(f"--cluster {address}: ")


@pytest.mark.second_chance("distributed gives its own thread 10 s to start, and asserts that it has")
def test_a_scheduler_without_workers_is_refused():
    with (
        local_cluster(0) as empty,
        pytest.raises(InputError, match="has no worker; start one with `dask worker tcp"),
        Dask(empty.scheduler_address) as dask,
    ):
        list(dask(neg, [1]))
