"""What a coarse encoder does to the cut-offs, and what that does to the inertia."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import identify
from identify.signals import choose_signal_settings
from identify.signals.encoder_noise import NEGLIGIBLE, SHARE, EncoderNoise, _SessionPower, encoder_noise
from identify.signals.motion_spectrum import motion_spectrum

INERTIA, VISCOUS, DRY = 0.1, 0.05, 0.02
PERIOD = 2e-3


def moves(seed, duration=40.0):
    """(q, dq, ddq) of a joint that goes to and fro at many speeds, its ramps rounded over 40 ms."""
    rng = np.random.default_rng(seed)
    count = round(duration / PERIOD)
    pieces, sense = [], 1.0
    while sum(map(len, pieces)) < count:
        speed = rng.uniform(0.1, 1.5)
        ramp = np.linspace(0.0, speed, round(speed / 12.0 / PERIOD) + 2)
        stay = np.full(round(rng.uniform(0.3, 0.8) / speed / PERIOD), speed)
        pieces.append(sense * np.concatenate([ramp, stay, ramp[::-1], np.zeros(round(0.1 / PERIOD))]))
        sense = -sense
    width = round(0.04 / PERIOD)
    dq = np.convolve(np.concatenate(pieces)[:count], np.hanning(width) / np.hanning(width).sum(), "same")
    return (np.cumsum(dq) - 0.5 * dq) * PERIOD, dq, np.gradient(dq, PERIOD)


def written(folder, step, seed=0):
    """An experiment of one joint, its positions in whole counts of `step` rad."""
    rng = np.random.default_rng(seed)
    q, dq, ddq = moves(seed)
    torque = INERTIA * ddq + VISCOUS * dq + DRY * np.sign(np.where(np.abs(dq) < 1e-9, 0.0, dq))
    torque += 2e-3 * rng.standard_normal(len(q))
    recorded = np.round(q / step) * step if step else q
    folder.mkdir(parents=True, exist_ok=True)
    table = np.column_stack([PERIOD * np.arange(len(q)), recorded, torque])
    np.savetxt(folder / "session.csv", table, delimiter=",", header="t,q1,v1", comments="", fmt="%.9g")
    (folder / "experiment.yaml").write_text(
        "format: 1\nname: coarse\nrobot:\n  gravity: [0, 0, 0]\n  joints:\n"
        "  - {name: j1, type: revolute, alpha: 0, d: 0, theta: 0, r: 0, drive_gain: 1.0}\n"
        "payloads:\n- {name: none, mass: 0}\nsessions:\n- {file: session.csv, payload: none}\n"
    )
    return identify.load_experiment(folder)


@pytest.mark.parametrize("bits", [14, 16, 18])
def test_the_inertia_is_not_lowered_by_a_coarse_encoder(tmp_path, bits):
    experiment = written(tmp_path, 2 * np.pi / 2**bits)
    found = identify.identify(experiment, "usual").document()
    values = {each.name: each for each in found.parameters}
    inertia, dry = (
        values["ZZ1R"],
        values["FC1"],
    )  # with 2 f_m: up to 1 % low, its deviation ten times as large
    assert inertia.value == pytest.approx(INERTIA, rel=1e-3)
    assert dry.value == pytest.approx(DRY, rel=0.01)


def test_only_a_coarse_encoder_lowers_the_parallel_filter_and_the_reason_names_it(tmp_path):
    coarse = choose_signal_settings(written(tmp_path / "coarse", 2 * np.pi / 2**14))
    fine = choose_signal_settings(written(tmp_path / "fine", 2 * np.pi / 2**22))
    reason = {choice.name: choice.reason for choice in coarse.choices}["decimation_cutoff"]
    assert "noise of the encoder of j1" in reason
    assert coarse.decimation_cutoff < 0.6 * fine.decimation_cutoff
    assert coarse.position_cutoff[0] == pytest.approx(2.5 * coarse.decimation_cutoff, rel=0.01)
    assert fine.position_cutoff[0] == pytest.approx(5 * fine.choices[0].value, rel=0.01)


@given(
    density=st.floats(1e-16, 1e-8),
    torque_density=st.floats(1e-12, 1e-2),
    power=st.floats(1e-4, 1e4),
)
def test_up_to_the_highest_cutoff_the_encoder_adds_what_it_may(density, torque_density, power):
    noise = EncoderNoise(density, torque_density, power)
    cutoff = noise.highest_cutoff()
    frequency = np.linspace(0.0, cutoff, 20_001)
    added = np.trapezoid(density * (2 * np.pi * frequency) ** 4, frequency)
    allowed = max(SHARE * torque_density * cutoff, NEGLIGIBLE**2 * power)
    assert added == pytest.approx(allowed, rel=1e-3)


def test_the_torques_power_is_its_mean_square_over_all_pieces_of_a_session(tmp_path):
    """Three gaps cut the session into four segments, each of which counts alike."""
    experiment = written(tmp_path, 2 * np.pi / 2**18)
    table = np.loadtxt(tmp_path / "session.csv", delimiter=",", skiprows=1)
    table[:, 0] += np.floor(np.arange(len(table)) / 5000) * 1.0  # s, a hole after every 10 s
    np.savetxt(tmp_path / "session.csv", table, delimiter=",", header="t,q1,v1", comments="", fmt="%.9g")
    experiment = identify.load_experiment(tmp_path)
    session = experiment.read(experiment.sessions[0])
    assert len(session.segments) == 4
    spectra = [motion_spectrum(session, 0)]
    noise = encoder_noise([session], spectra, np.array([[2.0]]), 0)
    assert noise is not None
    assert noise.torque_power == pytest.approx(np.mean((2.0 * table[:, 2]) ** 2), rel=0.05)


def test_the_floor_of_a_flat_spectrum_is_its_level_up_to_the_end_of_the_band(tmp_path):
    experiment = written(tmp_path, 0.0)
    session = experiment.read(experiment.sessions[0])
    power = _SessionPower(session, np.array([[1.0]]), 0)
    flat = np.full(len(power.frequency), 3.0)
    assert power.floor(flat, 1.0) == pytest.approx(3.0)
    # An octave that begins above all frequencies there are still has a mean, that of the last.
    power.frequency = power.frequency[: len(flat) // 50]
    assert power.floor(flat[: len(flat) // 50], 1.0) == pytest.approx(3.0)
