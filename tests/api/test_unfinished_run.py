"""A proof whose run was killed: the page, REST and the command line say what happened, what is kept and how to go on."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import httpx
import pytest

from api.client import Client
from api.proof import read_conclusion
from api.service.accounts import Role
from api.service.plan_store import PlanStore
from api.unfinished_run import LEFT_OPEN, close_unfinished, unfinished_run
from daq.excitation.standard_plan import standard_plan
from daq.recovery import being_written, recording_state
from identify.recording import InputError
from tests.api.driven_arm import write_driven_arm

RIG = "rx130l-joint3-simulated"
SECONDS = 20.0
"""of the plan, so that a run can be killed in the midst of it"""
PAUSE = 0.02
"""s between two looks, which leave the processor to those who are looked at"""


def until(condition, patience=60.0):
    """What `condition()` gives once it gives something; processes of the rig end by themselves."""
    end = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < end, "it did not happen in time"
        threading.Event().wait(PAUSE)
    return found


def rows_of(path):
    try:
        return recording_state(path).rows
    except InputError:  # not begun yet
        return 0


@pytest.fixture
def arm(data_folder, rig):
    """The folder of an experiment of the rig in the data folder of a service."""
    folder = data_folder / "experiments" / "arm"
    write_driven_arm(folder, rig)
    return folder


def compensate(*arguments):
    return [sys.executable, "-m", "api", "compensate", RIG, *arguments, "--yes", "--json"]


def killed_in_the_second_run(arm, with_children):
    """A proof of the command line whose process was killed while the second run was recorded; its folder and the recording."""
    wanted = compensate("--experiment", str(arm), "--payload", "none", "--seconds", str(SECONDS))
    process = subprocess.Popen(wanted, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    folder = arm / "compensation" / "00"
    recording = folder / "incomplete" / "session-01.h5"
    try:
        until(lambda: recording.is_file() and rows_of(recording) > 500)
    finally:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        if with_children:
            for child in children:
                os.kill(int(child), signal.SIGKILL)
        process.kill()
        process.wait()
    until(lambda: not being_written(recording))
    return folder, recording


@pytest.mark.parametrize("with_children", [False, True], ids=["the command", "recorder and acquisition too"])
def test_a_command_killed_in_the_second_run_is_said_everywhere_and_gone_on_with(
    arm, with_children, start_service
):
    folder, recording = killed_in_the_second_run(arm, with_children)
    run = unfinished_run(folder)
    assert (run.drive, run.complete, run.recording) == ("with", False, "incomplete/session-01.h5")
    assert (LEFT_OPEN if with_children else "supervising process") in run.words
    assert 0.5 < run.seconds < SECONDS + 30.0  # with the way to the start
    assert "are kept in incomplete/session-01.h5; nothing was compared" in run.words

    running = start_service()
    http = running.client(Role.OPERATOR)
    (view,) = Client("", http=http).proofs("arm")
    assert (view.unfinished.drive, view.unfinished.words) == ("with", run.words)
    page = http.get("/pages/experiments/arm/proofs/00").text
    assert run.words in page
    assert f"--continue {folder.name}" in page

    again = subprocess.run(
        compensate("--experiment", str(arm), "--continue", "00"), capture_output=True, text=True, check=False
    )
    assert again.returncode == 0, again.stderr
    assert " ".join(run.words.split()) in " ".join(again.stderr.split())
    assert json.loads(again.stdout)["recording_with"] == "session-02.h5"
    assert unfinished_run(folder) is None
    kept = recording_state(recording)
    assert (kept.status, kept.rows > 500) == ("faulted" if with_children else "aborted", True)


def test_a_new_proof_says_which_earlier_one_was_cut_off_and_a_first_run_is_not_gone_on_with(arm, capfd):
    folder, _ = killed_in_the_second_run(arm, with_children=False)
    from api.commands.compensate import _to_be_gone_on_with
    from identify.recording import load_experiment

    (said,) = _to_be_gone_on_with(load_experiment(arm))
    assert said == f"proof 00: {unfinished_run(folder).words} --continue 00 drives it again."


def ended(client, session):
    """The state of a session that is over."""
    state = client.session("arm", session).state
    return state if state in ("done", "complete", "aborted", "faulted") else None


def through(client, session, *steps):
    for step in steps:
        client.step("arm", session, step, **({"mass": 0.0} if step == "weigh" else {}))


def test_a_service_killed_in_the_second_run_says_so_when_it_is_there_again(arm, data_folder, serve, rig):
    plan = PlanStore(data_folder / "plans").add(standard_plan(rig, SECONDS, name="long"))
    process, address = serve()
    with Client(address, timeout=60) as client:
        client.wait(client.fit("arm", "load-velocity"))
        client.wait(client.prepare_proof("arm", RIG, plan, "none"))
        first = client.prepare_drive("arm", "00", "without").id
        through(client, first, "check", "weigh", "confirm", "arm", "start")
        assert until(lambda: ended(client, first), 200.0) == "done", client.session("arm", first)
        proof = client.proof("arm", "00")
        assert (proof.next, proof.unfinished) == ("with", None)
        second = client.prepare_drive("arm", "00", "with").id
        through(client, second, "check", "weigh", "confirm", "arm", "start")
        folder = arm / "compensation" / "00"
        recording = folder / "incomplete" / "session-01.h5"
        until(lambda: recording.is_file() and rows_of(recording) > 500)
        assert client.proof("arm", "00").unfinished is None  # it is under way
        process.kill()
        process.wait()
    until(lambda: not being_written(recording))
    run = unfinished_run(folder)
    assert "supervising process" in run.words

    _process, address = serve()
    with Client(address, timeout=60) as client:
        proof = client.proof("arm", "00")
        assert (proof.next, proof.result, proof.unfinished.words) == ("with", None, run.words)
        pages = f"{address}/pages/experiments/arm"
        assert run.words in httpx.get(f"{pages}/proofs/00", timeout=60).text
        assert "second run ended early, to be run again" in httpx.get(f"{pages}/proofs", timeout=60).text
        assert run.words in httpx.get(f"{pages}/sessions/{second}", timeout=60).text
        again = client.prepare_drive("arm", "00", "with").id
        through(client, again, "check", "weigh", "confirm", "arm", "start")
        assert until(lambda: ended(client, again), 200.0) == "done", client.session("arm", again)
        proof = until(lambda: (now := client.proof("arm", "00")).next is None and now)
        assert proof.unfinished is None
    assert read_conclusion(folder).recording_with == "session-02.h5"
    assert recording.is_file()


def test_nothing_begun_and_damaged_recordings(tmp_path):
    assert unfinished_run(tmp_path) is None
    close_unfinished(tmp_path)
    (tmp_path / "incomplete").mkdir()
    (tmp_path / "incomplete" / "session-00.h5").write_bytes(b"no recording")
    run = unfinished_run(tmp_path)
    assert (run.drive, run.seconds) == ("without", 0.0)
    assert "cannot be read as a recording" in run.words
    close_unfinished(tmp_path)
    assert (tmp_path / "incomplete" / "session-00.h5").read_bytes() == b"no recording"
