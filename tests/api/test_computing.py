"""`--workers` and `--cluster`, by the commands themselves and by the jobs of a service."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from api.command_line import _register_commands, application
from api.computing import Computing
from api.service.database import open_database
from api.service.job_documents import JobResult
from api.service.jobs import JobRunner, JobState
from identify.estimation.executor import SERIAL, chosen_executor
from identify.estimation.processes import Processes
from identify.recording import InputError
from tests.identify.estimation.same_document import assert_same
from tests.plants.single_joint import record, write_experiment

COMMANDS = ("identify", "diagnose", "improve", "next", "compare", "simulate", "serve")


@pytest.fixture(scope="module")
def experiment(tmp_path_factory) -> Path:
    recorded = record({}, seed=3, duration=12.0, rate=200.0, payload_masses=(0.0, 3.0))
    return write_experiment(tmp_path_factory.mktemp("workers") / "joint", recorded)


def coulomb(*arguments: str) -> subprocess.CompletedProcess[str]:
    call = [sys.executable, "-m", "api", *arguments]
    return subprocess.run(call, capture_output=True, text=True, timeout=120, check=False)


def test_identify_prints_the_same_document_with_two_workers(experiment):
    alone, shared = (
        coulomb("identify", str(experiment), "--json", *more) for more in ((), ("--workers", "2"))
    )
    assert shared.returncode == 0, shared.stderr
    assert_same(json.loads(shared.stdout), json.loads(alone.stdout))


def test_identify_imports_only_what_it_needs(tmp_path):
    """The command is timed beside another identifier; most of these take a tenth of its time or more. `numpy.ma`
    comes with `np.median`, `np.quantile`, `np.unique` and `np.setdiff1d`, and all of it with SciPy, which only
    motion that repeats and parameters at a bound need."""
    once = record({}, seed=3, duration=12.0, rate=200.0, repeats=1, payload_masses=(0.0,))
    experiment = write_experiment(tmp_path / "joint", once)
    heavy = (
        "pandas",
        "matplotlib",
        "h5py",
        "fastapi",
        "can",
        "daq",
        "multiprocessing",
        "scipy",
        "ssl",
        "xml",
        "numpy.ma",
        "numpy.random",
        "identify.diagnosis",
        "identify.estimation.instrumental_variable",
        "identify.estimation.robust",
        "identify.estimation.position_lines",
    )
    program = (
        "import sys; sys.argv = ['coulomb', *sys.argv[1:]]\n"
        "from api.command_line import main\n"
        f"try:\n    main()\nfinally:\n    print([n for n in {heavy} if n in sys.modules], file=sys.stderr)"
    )
    call = [sys.executable, "-c", program, "identify", str(experiment), "--json"]
    told = subprocess.run(call, capture_output=True, text=True, timeout=120, check=False)
    assert told.stderr == "[]\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_that_computes_long_takes_the_same_two_options(command):
    _register_commands("")
    shown = CliRunner().invoke(application, [command, "--help"], terminal_width=200, color=False)
    assert "--workers" in shown.output
    assert "--cluster" in shown.output


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--workers", "0"), "--workers"),
        (("--workers", "many"), "--workers"),
        (("--cluster", "nowhere"), "--cluster nowhere: missing port"),
        (("--cluster", "tcp://localhost:1", "--workers", "2"), "give one of them"),
    ],
)
def test_wrong_values_are_told_in_one_line_with_status_2(experiment, options, words):
    for command in (("identify", str(experiment)), ("serve", "--port", "0")):
        told = coulomb(*command, *options)
        assert told.returncode == 2, told.stderr
        assert told.stdout == ""
        assert len(told.stderr.strip().splitlines()) == 1
        assert words in told.stderr


def test_without_the_extra_a_cluster_is_refused_in_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"needs the extra 'dask': pip install 'coulomb\[dask\]'"):
        Computing(cluster="tcp://localhost:8786").check()


def test_one_worker_is_this_process():
    with Computing()():
        assert chosen_executor() is SERIAL
    with Computing(workers=2)():
        chosen = chosen_executor()
        assert isinstance(chosen, Processes)
        assert chosen.workers == 2
    assert chosen_executor() is SERIAL


def test_a_diagnosis_that_is_told_nothing_uses_a_second_core(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1, 2, 3})
    assert Computing.of_diagnosis(None, None) == Computing(forks=2)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {3})
    assert Computing.of_diagnosis(None, None) == Computing()
    assert Computing.of_diagnosis(1, None) == Computing()
    assert Computing.of_diagnosis(3, None) == Computing(workers=3)
    assert Computing.of_diagnosis(None, "tcp://host:8786") == Computing(cluster="tcp://host:8786")


WORK = """
import os
from identify.estimation.executor import chosen_executor

def processes(progress):
    return {"own": os.getpid(), "workers": list(chosen_executor()(pid, range(4)))}

def pid(item):
    return os.getpid()
"""


def test_a_job_of_the_service_divides_its_work_among_the_workers_of_the_settings(
    tmp_path, monkeypatch, clock
):
    (tmp_path / "work_on_workers.py").write_text(WORK)
    monkeypatch.syspath_prepend(str(tmp_path))
    database = open_database(tmp_path, None)
    runner = JobRunner(database, clock, computing=Computing(workers=2))
    followed: list[JobState] = []
    results = []
    runner.listen(lambda job: followed.append(job.state))
    runner.start()
    try:
        job = runner.submit(
            "test",
            "work_on_workers:processes",
            dict,
            lambda found: results.append(found) or JobResult(),
            user="ada",
            experiment=None,
        )
        for thread in runner._threads:
            runner._queue.put(None)
            thread.join(60)
    finally:
        runner.close()
        database.close()
    assert followed[-1] is JobState.DONE, runner.get(job.id)
    (found,) = results
    assert found["own"] != os.getpid()
    assert found["own"] not in found["workers"]
    assert 1 <= len(set(found["workers"])) <= 2


@pytest.mark.parametrize(
    ("arguments", "status"), [(("effects", "--json"), 0), (("identify", "no-such-folder"), 2)]
)
def test_a_command_that_ends_at_once_says_all_and_keeps_its_status(arguments, status):
    """What else was to be done at the end is done first: the exit functions are called, the last one registered first."""
    program = (
        "import atexit, runpy, sys; sys.argv = ['coulomb', *sys.argv[1:]]\n"
        "import api.command_line, api.commands.identify\n"
        "register = api.commands.identify.register\n"
        "def registered(application):\n"
        "    atexit.register(print, 'exit functions called', file=sys.stderr); register(application)\n"
        "api.commands.identify.register = registered\n"
        "runpy.run_module('api', run_name='__main__')"
    )
    call = [sys.executable, "-c", program, *arguments]
    told = subprocess.run(call, capture_output=True, text=True, timeout=120, check=False)
    assert told.returncode == status
    assert "exit functions called" in told.stderr
    if status == 0:
        assert json.loads(told.stdout)
