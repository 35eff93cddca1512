"""What is said against a recording whose plan was driven to its end."""

import h5py
import numpy as np
import pytest

from daq.recording_verdict import _AROUND, RecordingVerdict, _cycles_behind
from daq.recovery import recover_experiment
from daq.session_events import SessionState
from identify.recording import load_experiment
from tests.daq.recorded_swing import recorded_swing
from tests.daq.rig_variants import with_faults


def problems(rig, rows: np.ndarray, block: int = 37) -> list[str]:
    verdict = RecordingVerdict(rig)
    for start in range(0, len(rows), block):
        verdict.see(rows[start : start + block])
        verdict.take(rows[start : start + block])
    return verdict.problems()


def lose(rows: np.ndarray, lost: np.ndarray) -> None:
    rows["valid"][lost], rows["position"][lost], rows["command"][lost] = 0, 0, 0


def test_nothing_is_said_of_a_good_recording(rig):
    assert problems(rig, recorded_swing(rig)) == []


def test_few_losses_are_borne_and_many_are_said(rig):
    rows = recorded_swing(rig)
    lose(rows, np.arange(0, len(rows), 50))
    assert problems(rig, rows) == []
    rows = recorded_swing(rig)
    lose(rows, np.arange(0, len(rows), 2))
    (said,) = problems(rig, rows)
    assert "only 50 % of the rows have an answer of every drive, 90 % are needed" in said


@pytest.mark.parametrize("block", [1, 16, 500])
@pytest.mark.parametrize("begin", [400, 1500, 3777])
def test_answers_that_fall_behind_by_a_cycle_and_stay_so_are_seen_where_it_began(rig, begin, block):
    rows = recorded_swing(rig)
    late = rows.copy()
    for name in ("position", "command"):
        late[name][begin + 1 :] = rows[name][begin:-1]
    lose(late, np.array([begin]))
    (said,) = problems(rig, late, block)
    assert "its answers fell 1 cycle(s) behind and stayed so" in said
    lost = rows.copy()
    lose(lost, np.array([begin]))
    assert problems(rig, lost, block) == []


def test_a_current_that_does_not_move_is_said_and_one_that_rests_is_not(rig):
    rows = recorded_swing(rig)
    rows["command"] = 0
    (said,) = problems(rig, rows)
    assert "the current stood at 0 counts for" in said
    assert "the drive's profile" in said
    rows = recorded_swing(rig)
    rows["setpoint"][:2000], rows["command"][:2000] = rows["setpoint"][0], 7
    assert problems(rig, rows) == []


def test_answers_that_come_twice_are_said(rig):
    rows = recorded_swing(rig)
    rows["valid"][::3] |= 0x10
    (said,) = problems(rig, rows)
    assert "33 % of the answers came more than once" in said


@pytest.mark.parametrize(
    ("fault", "value", "words"),
    [
        ("late", 1000, "cycle(s) behind"),
        ("lose", 500, "of the rows have an answer of every drive"),
        ("double", 1000, "came more than once"),
        ("current-stuck", 1, "the current stood at 0 counts"),
    ],
)
def test_a_session_in_doubt_is_kept_said_and_listed_only_by_a_person(rig, armed_session, fault, value, words):
    planned = {"fault": fault, "value": value, "phase": "fast", "speed": 10.0}
    session = armed_session(with_faults(rig, planned=[planned]))
    session.start()
    assert session.wait(120) is SessionState.FAULTED, session.reason
    assert "the plan ran to its end, but: joint j3" in session.reason or words in session.reason
    assert words in session.reason
    with h5py.File(session.file) as file:
        assert file.attrs["stop_cause"] == "data in doubt"
    (state,) = recover_experiment(session.experiment, "")
    assert not state.admitted
    assert load_experiment(session.experiment).sessions == ()


def around_a_gap(position, gap: int, behind: int) -> tuple[np.ndarray, np.ndarray]:
    """Whole counts before and after `gap` cycles without an answer, after which each answer is `behind` cycles old."""
    before, after = np.arange(-_AROUND, 0), np.arange(_AROUND) + gap - behind
    return np.rint(position(before)), np.rint(position(after))


@pytest.mark.parametrize("gap", [1, 2, 5])
@pytest.mark.parametrize(("speed", "bend"), [(900.0, 3.0), (12.0, 0.0), (400.0, 250.0)])
def test_by_how_many_cycles_answers_fell_behind_is_told_where_an_axis_moves(gap, speed, bend):
    for behind in range(gap + 1):
        answers = around_a_gap(lambda k: speed * k + bend * k**2, gap, behind)
        assert _cycles_behind(*answers, gap) == behind


@pytest.mark.parametrize("speed", [0.0, 0.05, -0.1])
def test_it_is_not_told_where_a_cycle_is_less_than_the_encoder_rounds(speed):
    for behind in range(3):
        assert _cycles_behind(*around_a_gap(lambda k: speed * k + 1000.0, 2, behind), 2) == 0
