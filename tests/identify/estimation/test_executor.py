"""Where the sessions are reduced changes nothing of what comes out."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.estimation.executor import SERIAL, Dask, Processes
from identify.estimation.observation import Slot, observe
from identify.estimation.requested_model import open_record, requested_model


@pytest.fixture(scope="module")
def observe_with(tx40):
    record = open_record(identify.load_experiment(tx40))
    slots = [Slot.of(term) for term in requested_model(record, "usual").terms]
    entries = list(record.experiment.sessions)
    return lambda executor: observe(record, entries, slots, executor=executor)


def assert_identical(found, expected):
    assert found.blocks == expected.blocks
    for own, other in zip(found.factors, expected.factors, strict=True):
        for factor, expected_factor in zip(own, other, strict=True):
            np.testing.assert_array_equal(factor.r, expected_factor.r)
            assert factor.rows == expected_factor.rows


def test_processes_give_the_factors_that_one_process_gives(observe_with):
    assert_identical(observe_with(Processes(2)), observe_with(SERIAL))


def test_a_dask_cluster_gives_the_factors_that_one_process_gives(observe_with):
    distributed = pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert_identical(observe_with(Dask(client)), observe_with(SERIAL))
