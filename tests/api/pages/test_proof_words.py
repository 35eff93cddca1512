"""What the pages say of a proof, above all where it is no better."""

from dataclasses import replace

from api.pages.proof_words import change, changes, improved, joint_rows, proof_row
from api.proof import ProofSettings
from api.service.proofs import ProofState
from api.unfinished_run import UnfinishedRun
from identify.recording import Payload
from identify.results.compensation import CompensationDocument, FollowingPart, JointFollowing


def joint(name: str, without: float, with_: float) -> JointFollowing:
    part = FollowingPart(where="driven by its load", samples=5, rms_without=without, rms_with=with_)
    return JointFollowing(
        joint=name,
        unit="rad",
        rms_without=without,
        rms_with=with_,
        peak_without=2 * without,
        peak_with=None,
        largest_offset=3.0,
        bounded=0.0,
        speeds=(),
        quadrants=(part,),
    )


def test_a_joint_that_follows_worse_is_said_to() -> None:
    better, worse = joint("j1", 1e-3, 2e-4), joint("j2", 1e-3, 1.1e-3)
    assert [improved(each) for each in (better, worse)] == [True, False]
    document = CompensationDocument(
        experiment="arm",
        rig="bench",
        payload="none",
        model="usual",
        part="whole",
        share=0.6,
        recording_without="session-00.h5",
        recording_with="session-01.h5",
        completed=True,
        reason="",
        following_limits=(1e-3, 1e-3),
        joints=(better, worse),
        folder="compensation/00",
        remarks=(),
    )
    assert changes(document) == "j1\u00a0−80\u202f%, j2\u00a0+10\u202f%"
    rows = joint_rows(worse)
    assert [row.words for row in rows] == [
        "root mean square, all of the plan",
        "driven by its load",
        "peak",
    ]
    assert [row.worse for row in rows] == [True, True, False]
    assert rows[0].without == 1.0
    assert rows[-1].change == "–"
    assert change(None, 1.0) == "–"


def test_a_proof_whose_first_run_was_driven_on_the_command_line_waits_there() -> None:
    settings = ProofSettings(
        experiment="arm",
        rig="bench",
        plan="standard plan",
        payload=Payload(name="none", mass=0.0),
        model="usual",
        part="whole",
        share=0.6,
        operator="operator",
        created="2026-11-28T09:00:00+00:00",
    )
    states = [ProofState("00", settings, None, None, None, elsewhere) for elsewhere in (True, False)]
    assert [proof_row("arm", state).words for state in states] == [
        "to be continued on the command line",
        "to be run without it",
    ]
    second = UnfinishedRun("with", False, "incomplete/session-01.h5", 4.2, "the program was killed")
    ended = [replace(state, unfinished=second) for state in states]
    assert [proof_row("arm", state).words for state in ended] == [
        "second run ended early, to be continued on the command line",
        "second run ended early, to be run again",
    ]
