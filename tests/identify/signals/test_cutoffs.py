"""The rule for cut-offs: what it must do on any machine, and what it does on two measured ones."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from identify.recording import InputError, load_experiment
from identify.signals import choose_signal_settings, motion_blocks
from identify.signals.cutoff import choose_from_sessions
from identify.signals.motion_spectrum import motion_spectrum
from identify.signals.settings import Choice


def ladder(period, duration, pace=1.0):
    """Position of a joint that goes to and fro with ramps of 0.15 s / pace every 2 s / pace."""
    time = pace * period * np.arange(round(duration / period))
    sense = np.sign(np.sin(2 * np.pi * time / 4)) * (np.abs(np.sin(2 * np.pi * time / 4)) > 0.1)
    ramp = np.hanning(max(3, round(0.15 / (pace * period))))
    velocity = np.convolve(sense, ramp / ramp.sum(), "same")
    return np.cumsum(velocity) * period * pace


def measured(position, step, seed=0):
    """The position as an encoder of that step reads it."""
    return (
        np.round(position / step + np.random.default_rng(seed).uniform(-0.5, 0.5)) * step
        if step
        else position
    )


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(pace=st.floats(0.2, 4.0), step=st.sampled_from([1e-6, 1e-5, 1e-4]))
def test_cutoffs_follow_the_pace_of_the_motion(made_session, made_experiment, pace, step):
    fast = made_session(measured(ladder(1e-3, 40.0, pace), step), 1e-3)
    plain = made_session(measured(ladder(1e-3, 40.0), step), 1e-3)
    chosen = choose_from_sessions(made_experiment(), [fast])
    reference = choose_from_sessions(made_experiment(), [plain])
    assert chosen.decimation_cutoff == pytest.approx(pace * reference.decimation_cutoff, rel=0.25)
    assert chosen.position_cutoff[0] == pytest.approx(pace * reference.position_cutoff[0], rel=0.25)


@pytest.mark.parametrize("step", [0.0, 1e-6, 1e-4, 2e-3])
@pytest.mark.parametrize("period", [1e-4, 1e-3, 5e-3])
def test_the_encoder_and_the_sampling_rate_do_not_change_what_the_motion_is(made_session, period, step):
    spectrum = motion_spectrum(made_session(measured(ladder(period, 40.0), step), period), 0)
    assert spectrum is not None
    # Ramps of 0.15 s with a Hann profile hold 98 % of their power below 1.3 / 0.15 s.
    assert spectrum.bandwidth == pytest.approx(1.3 / 0.15, rel=0.15)


def test_the_position_keeps_five_times_the_motion(made_session, made_experiment):
    session = made_session(measured(ladder(1e-3, 40.0), 1e-5), 1e-3)
    chosen = choose_from_sessions(made_experiment(), [session])
    bandwidth = chosen.choices[0]
    assert bandwidth.name == "motion_bandwidth"
    assert chosen.position_cutoff[0] == pytest.approx(5 * bandwidth.value, rel=0.02)
    assert chosen.decimation_cutoff == pytest.approx(2 * bandwidth.value, rel=0.02)


def test_a_coarse_encoder_lowers_the_position_cutoff_and_says_why(made_session, made_experiment):
    slow = 0.05 * ladder(1e-3, 40.0)
    rng = np.random.default_rng(0)
    session = made_session(slow + 2e-3 * rng.standard_normal(len(slow)), 1e-3)
    chosen = choose_from_sessions(made_experiment(), [session])
    reason = chosen.choices[-1].reason
    assert "noise makes up most of the acceleration" in reason
    assert chosen.decimation_cutoff <= chosen.position_cutoff[0] < 5 * chosen.choices[0].value


def test_slow_sampling_keeps_the_filters_well_below_nyquist(made_session, made_experiment):
    time = 0.1 * np.arange(3000)
    session = made_session(measured(np.sin(2 * np.pi * 0.7 * time), 1e-4), 0.1)
    chosen = choose_from_sessions(made_experiment(), [session])
    assert chosen.position_cutoff[0] <= 4.0
    assert chosen.decimation_cutoff <= 4.0
    assert "sampling frequency" in chosen.choices[-1].reason
    assert len(list(motion_blocks(session, chosen))) >= 1


def test_a_slow_record_still_gives_enough_samples(made_session, made_experiment):
    time = 1e-3 * np.arange(30_000)
    session = made_session(measured(np.sin(2 * np.pi * 0.02 * time), 1e-5), 1e-3)
    chosen = choose_from_sessions(made_experiment(), [session])
    assert sum(block.count for block in motion_blocks(session, chosen)) >= 80
    assert "100 decimated samples" in chosen.choices[1].reason


def test_what_the_user_sets_stays(made_session, made_experiment):
    session = made_session(measured(ladder(1e-3, 20.0), 1e-5), 1e-3)
    experiment = made_experiment(position_cutoff=61.7, decimation_cutoff=23.45)
    chosen = choose_from_sessions(experiment, [session])
    assert chosen.position_cutoff == (61.7,)
    assert chosen.decimation_cutoff == 23.45
    assert [choice.reason for choice in chosen.choices[1:]] == ["set in the experiment"] * 2
    assert chosen.choices[1] == Choice("decimation_cutoff", 23.45, "Hz", "set in the experiment")


@pytest.mark.parametrize("name", ["position_cutoff", "decimation_cutoff"])
def test_a_cutoff_above_nyquist_is_refused_by_name(made_session, made_experiment, name):
    session = made_session(measured(ladder(1e-3, 20.0), 1e-5), 1e-3)
    with pytest.raises(
        InputError, match=f"signals.{name}: 600 Hz is not below the Nyquist frequency of the record, 500"
    ):
        choose_from_sessions(made_experiment(**{name: 600.0}), [session])


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_joint_that_does_not_move_is_no_motion(made_session, made_experiment, noise):
    rest = 0.3 + noise * np.random.default_rng(0).standard_normal(20_000)
    session = made_session(rest, 1e-3)
    assert motion_spectrum(session, 0) is None
    with pytest.raises(InputError, match="no joint moves"):
        choose_from_sessions(made_experiment(), [session])


def test_without_an_identification_session_there_is_nothing_to_fit(made_experiment):
    with pytest.raises(InputError, match="sessions: none has the role identification"):
        choose_signal_settings(made_experiment())


def usual(block, gain):
    """Columns of the usual model of one joint, and the measured force, through the parallel filter."""
    columns = np.column_stack([block.ddq, block.dq, np.sign(block.dq), np.ones_like(block.dq)])
    return block.decimate(columns), block.decimate(block.command @ gain.T)[:, 0]


def test_the_emps_drive_gives_the_published_model(emps):
    experiment = load_experiment(emps)
    session = experiment.read(experiment.sessions[0])
    blocks = [
        usual(block, experiment.drive_gain)
        for block in motion_blocks(session, choose_signal_settings(experiment))
    ]
    columns, force = (np.concatenate(part) for part in zip(*blocks, strict=True))
    found = np.linalg.lstsq(columns, force, rcond=None)[0]
    published = [95.1089, 203.5034, 20.3935, -3.1648]
    assert (np.abs(found - published) < [0.1, 1.5, 0.15, 0.05]).all()
    assert np.linalg.norm(force - columns @ found) / np.linalg.norm(force) == pytest.approx(0.0404, abs=0.001)


def test_the_tx40_moves_below_ten_hertz_and_all_joints_say_so(tx40):
    experiment = load_experiment(tx40)
    for entry in experiment.sessions:
        session = experiment.read(entry)
        spectra = [motion_spectrum(session, joint) for joint in range(6)]
        assert all(spectrum is not None and 6 < spectrum.bandwidth < 10 for spectrum in spectra)
