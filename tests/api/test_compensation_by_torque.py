"""The proof where drives take torque alone (mode 10): both runs held by our loop over the (virtual) bus; refused, or stopped,
where that may do harm."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import h5py
import numpy as np
import pytest

from api.compensation import torque_ahead
from api.compensation_run import CompensationRun
from api.compensation_text import compensation_text
from api.proof import Proof, first_recording, next_folder
from daq.excitation.excitation_plan import ExcitationPlan
from daq.rig import Rig
from daq.session_events import SessionState, StepOutOfTurn
from daq.torque_offset import torque_offset
from identify.identification import Identification, identify
from identify.recording import load_experiment
from tests.api.driven_arm import short_plan, write_driven_arm
from tests.api.proof_settings import proof_settings
from tests.daq.rig_variants import with_faults

RIG = "rx130l-joint3-simulated"


def held_by_us(rig: Rig, **changes: object) -> Rig:
    """The rig whose drive takes torque alone, its arm held by a brake without power."""
    torque = {"feedforward": "cyclic-torque", "held_by": "brake"} | changes
    return rig.model_copy(update={"axes": tuple(axis.model_copy(update=torque) for axis in rig.axes)})


@pytest.fixture(scope="module")
def rig() -> Rig:
    return held_by_us(Rig.load(RIG))


@pytest.fixture(scope="module")
def plan() -> ExcitationPlan:
    return short_plan("short")


@pytest.fixture(scope="module")
def result(rig, tmp_path_factory) -> Identification:
    folder = tmp_path_factory.mktemp("torque") / "arm"
    write_driven_arm(folder, rig)
    return identify(load_experiment(folder), "load-velocity")


@pytest.fixture(scope="module")
def half(rig, plan, result, tmp_path_factory) -> Proof:
    """A proof whose run without the model's torque is driven."""
    payload = rig.payload("none")
    ahead = torque_ahead(result, rig, plan, payload, "whole", 0.6)
    folder = next_folder(tmp_path_factory.mktemp("proofs"))
    run = CompensationRun(Proof(folder, proof_settings(rig, "arm", payload), rig, plan, ahead), seed=5)
    assert drive(run.without()) is SessionState.DONE
    return run.proof


def drive(session):
    with session:
        check = session.check()
        assert check.ok, check.problems
        assert any("held by this computer's position loop" in item.words for item in check.items)
        session.confirm_payload(session.payload.mass)
        session.arm()
        session.start()
        return session.wait(200.0)


def recorded(file):
    """Settings kept with a recording, and the phases of its rows."""
    with h5py.File(file, "r") as held:
        return json.loads(str(held.attrs["counters"]))["remarks"], "controller" in held.attrs


def test_the_model_makes_our_loop_follow_better_and_the_result_says_whose_loop_it_was(half, rig):
    loop = half.ahead.loop
    assert 75.0 < loop.crossover[0] < 85.0  # 60° of phase with a dead time of 4 ms
    again = Proof.load(half.folder, rig)
    assert again.ahead.loop.words == loop.words
    assert np.array_equal(again.ahead.loop.bound, [1799])  # 60 % of 18 A in per mille of 6 A
    run = CompensationRun.continued(again, seed=6)
    assert drive(run.with_torque()) is SessionState.DONE
    document = run.document()
    (joint,) = document.joints
    assert joint.rms_with < 0.5 * joint.rms_without
    assert joint.peak_with < joint.peak_without
    assert document.held_by == "this computer"
    assert "the drive's own was not judged" in compensation_text(document)
    # what is kept of the drive's gains would be taken for the loop that was closed
    assert any("the rig file names no safety_output" in remark for remark in half.ahead.remarks)
    remarks, controller = recorded(first_recording(half.folder))
    assert not controller
    assert any("mode 10, target torque 0x6071" in remark for remark in remarks)
    assert any("stops by itself after 20 ms without a torque setpoint" in remark for remark in remarks)
    (half.folder / "compensation.json").unlink()


def test_a_model_with_the_wrong_sign_is_stopped_in_this_loop_too(half):
    offset = torque_offset(half.rig, -half.ahead.torque, 0.6, faded=False)
    run = CompensationRun.continued(replace(half, ahead=replace(half.ahead, offset=offset)), seed=7)
    session = run.with_torque()
    assert drive(session) is SessionState.FAULTED
    assert "follow worse" in session.reason or "following error grows" in session.reason
    first, second = half.error(first_recording(half.folder)), half.error(session.file)
    assert second.cycle[-1] < 0.8 * first.cycle[-1]
    assert second.peak()[0] < half.rig.axes[0].limits.following_error


def test_a_drive_that_does_not_show_the_mode_moves_no_further_than_to_where_the_plan_begins(half):
    rig = with_faults(half.rig, planned=[{"fault": "keep-mode", "phase": "enabled"}])
    session = CompensationRun(replace(half, rig=rig, folder=half.folder.parent / "77"), seed=8).without()
    assert drive(session) is SessionState.FAULTED
    assert re.search(r"0x6061.*expected mode 10 within .*stays in mode 8", session.reason), session.reason
    assert session.file is None  # nothing of the plan was driven


def test_a_drive_that_cannot_be_told_to_stop_by_itself_is_refused(half):
    deaf = {**half.rig.simulated["drives"][0], "oddities": {"missing": ["0x1400:05"]}}
    rig = half.rig.model_copy(update={"simulated": {**half.rig.simulated, "drives": [deaf]}})
    session = CompensationRun(replace(half, rig=rig, folder=half.folder.parent / "78"), seed=9).without()
    with (
        session,
        pytest.raises(StepOutOfTurn, match=r"0x1400:05.*stop by themselves when no setpoint comes"),
    ):
        session.check()
