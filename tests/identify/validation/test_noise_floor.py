"""The noise floor against what the plant's noise is: on a joint that has nothing but the usual model, the fit's error."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from identify import identify, load_experiment
from identify.validation.noise_floor import _scatter, _speeds_differ
from tests.plants.closed_loop import STEP, draw_arm, simulate, write_arm
from tests.plants.single_joint import record, write_experiment


def identified(folder, effects, **motion):
    recorded = record(effects, payload_masses=(0.0, 3.0), duration=30.0, **motion)
    return identify(load_experiment(write_experiment(folder, recorded)), "usual").document()


@pytest.mark.parametrize(
    ("seed", "rate", "repeats", "pace"),
    [(1, 500.0, 3, 1.0), (2, 250.0, 2, 0.77), (3, 1000.0, 3, 0.7), (4, 500.0, 2, 1.53)],
)
def test_where_nothing_is_missing_the_floor_is_the_error(tmp_path, seed, rate, repeats, pace):
    """Whatever part of a sample the period ends at: `pace` makes it end between two."""
    found = identified(tmp_path / "joint", {}, seed=seed, rate=rate, repeats=repeats, pace=pace)
    assert found.joints[0].noise_floor == pytest.approx(found.relative_error, rel=0.12)


def test_a_missing_effect_raises_the_error_and_not_the_floor(tmp_path):
    plain = identified(tmp_path / "plain", {}, seed=5, repeats=3).joints[0]
    hidden = identified(tmp_path / "hidden", {"stribeck": 1.0}, seed=5, repeats=3).joints[0]
    assert hidden.relative_error > 3 * plain.relative_error
    assert hidden.noise_floor == pytest.approx(plain.noise_floor, rel=0.05)


@pytest.mark.parametrize("seed", range(6))
def test_slow_ways_there_and_back_are_no_repeats(tmp_path, seed):
    found = identified(tmp_path / "joint", {}, seed=seed, rate=250.0, repeats=1, pace=0.8)
    floor = found.joints[0].noise_floor
    assert floor is None or floor == pytest.approx(found.relative_error, rel=0.2)


def test_a_floor_is_a_part_of_the_torque_of_all_sessions_as_the_error_is(tmp_path):
    """Where only the session repeats that takes less torque, its noise is less of the torque of both."""
    folder = write_experiment(
        tmp_path / "joint", record({}, payload_masses=(0.0, 8.0), duration=20.0, seed=8, repeats=2)
    )
    once = record({}, payload_masses=(0.0, 8.0), duration=20.0, seed=9, repeats=1)
    other = write_experiment(tmp_path / "once", once)
    (other / "session-01.csv").replace(folder / "session-01.csv")
    joint = identify(load_experiment(folder), "usual").document().joints[0]
    assert joint.noise_floor <= joint.relative_error * (1 + 1e-9)
    assert joint.noise_floor == pytest.approx(joint.relative_error, rel=0.12)


def _low_passed(values, cutoff):
    """The band that identification looks at, by another filter; ends left out."""
    away = round(1.0 / STEP)
    return sosfiltfilt(butter(4, cutoff, fs=1 / STEP, output="sos"), values)[away:-away]


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    """Ten machines whose soft controllers answer disturbances of 7 %, so that repeats of the motion differ: each with its
    document and the noise that it was simulated with, part of the torque."""
    random = np.random.default_rng(3)
    arms = [
        draw_arm(
            random,
            bandwidth=2.5,
            amplitude=0.07,
            payloads=(0.0, 3.0),
            duration=24.0,
            period=float(random.uniform(5, 8)),
        )
        for _ in range(10)
    ]
    disturbances = []
    sessions = simulate(arms, disturbances)
    folder = tmp_path_factory.mktemp("answered")
    found = []
    for number, (arm, recorded) in enumerate(zip(arms, sessions, strict=True)):
        document = identify(load_experiment(write_arm(folder / str(number), arm, recorded))).document()
        cutoff = next(
            choice.value for choice in document.signals if "decim" in choice.name or "parallel" in choice.name
        )
        noise = [_low_passed(pushed, cutoff) for pushed in disturbances[2 * number : 2 * number + 2]]
        torque = [_low_passed(command * arm.drive_gain, cutoff) for _, _, command in recorded]
        truth = np.linalg.norm(np.concatenate(noise)) / np.linalg.norm(np.concatenate(torque))
        found.append((document.joints[0], float(truth)))
    return found


def test_in_closed_loop_the_floor_is_the_disturbance_and_not_what_the_controller_makes_of_it(answered):
    """Their torques differ by as little as 0.7 times the disturbance, which the motion answers too."""
    known = [(joint, truth) for joint, truth in answered if joint.noise_floor is not None]
    assert len(known) >= 6  # where the repeats differ too much there is none
    near = [joint.noise_floor == pytest.approx(truth, rel=0.15) for joint, truth in known]
    assert np.mean(near) >= 0.9
    inside = [
        joint.noise_floor_interval[0] <= truth <= joint.noise_floor_interval[1] for joint, truth in known
    ]
    assert np.mean(inside) >= 0.9


def test_no_floor_lies_above_the_error_of_the_model(answered):
    for joint, _ in answered:
        if joint.noise_floor is None:
            assert joint.noise_floor_interval is None
        else:
            assert joint.noise_floor_interval[0] <= joint.noise_floor <= joint.noise_floor_interval[1]
            assert joint.noise_floor <= joint.relative_error * (1 + 1e-9)


def test_two_periods_differ_by_the_root_mean_square_of_the_joint_that_differs_most():
    """A period of 40.25 samples: the velocity one period later lies between two samples."""
    time = np.arange(200)
    ramps = np.column_stack([0.01 * time, -0.03 * time])
    assert _speeds_differ(ramps, 40.25) == pytest.approx(0.03 * 40.25)
    repeating = np.sin(2 * np.pi * time / 40.25)[:, None] * [1.0, 2.0]
    assert _speeds_differ(repeating, 40.25) < 0.01
    spike = np.zeros((200, 2))
    spike[100, 1] = 6.0  # in two of the 160 differences
    assert _speeds_differ(spike, 40.0) == pytest.approx(6.0 * np.sqrt(2 / 159))


def test_the_scatter_of_repeats_is_that_about_their_mean_with_one_degree_of_freedom_less():
    """Three whole repeats of ten phases and a half of a fourth: of 1, 2, 3, 4 the half has the squares of four."""
    period, step = 1.0, 0.1

    def course(times):
        return np.floor(times / period + 1e-9)[:, None] * [1.0, 10.0]

    squares, freedom = _scatter(course, 3.45, period, step)
    assert squares.sum(axis=0) == pytest.approx([5 * 5.0 + 5 * 2.0, 100 * 35.0])
    assert freedom.sum(axis=0).tolist() == [5 * 3 + 5 * 2] * 2
    none = _scatter(
        course, 3.45, period, step, lambda times: np.ones((len(times), 2), bool) & (times < 3)[:, None]
    )
    assert none[1].sum(axis=0).tolist() == [5 * 2] * 2  # a phase counts where it counts in every repeat
