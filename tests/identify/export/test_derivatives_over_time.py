"""Elasticity, backlash and delay, exported with what they keep from cycle to cycle: every format is the model."""

from __future__ import annotations

import numpy as np
import pytest

from identify.export.exported_model import exported_model
from identify.export.formula_torque import module_of, module_torque
from identify.export.python_code import python_code
from identify.export.python_process import python_torque
from identify.export.record_error import Motion
from identify.export.write import write_export
from identify.identification import identify
from tests.identify.export.derivatives import (
    PERIOD,
    along_the_record,
    in_formats,
    one_inertia,
    sine,
    with_play,
    with_values,
)


@pytest.mark.parametrize(("effects", "latency"), [("delay", 1), ("elasticity", 2), ("all", 3)])
def test_every_format_is_the_model_on_a_session_that_was_not_fitted(
    plant, with_derivatives, request, tmp_path, effects, latency
):
    """Where the velocity's sign is the direction that the identifier has, which knows the instant of a reversal better; the
    last samples have no neighbours behind them, and go on in another way."""
    result = with_derivatives[effects]
    model = exported_model(result)
    assert (model.latency, model.lost) == (latency, ())
    motion, torque, alike = along_the_record(result, plant.sessions[-1].file)
    assert motion.payload.mass > 0
    first = 1500
    part = Motion(
        motion.t[:first], motion.q[:first], motion.dq[:first], motion.ddq[:first], None, motion.payload
    )
    judged = np.convolve(~alike, np.ones(2 * latency + 1), "same")[:first] == 0
    assert judged.sum() > 0.9 * first
    judged[-4:] = False
    if effects == "all":
        _, formats = request.getfixturevalue("all_formats")
    else:
        formats = in_formats(model, tmp_path, compiled=False)
    for name, torque_of in formats.items():
        given = torque_of(part)
        assert given == pytest.approx(formats["formulas"](part), rel=1e-9, abs=1e-9), name
        assert given[judged] == pytest.approx(torque[:first][judged], rel=1e-9, abs=1e-9), name


def test_a_link_pushed_by_motion_is_the_model_s_in_every_format_on_a_session_that_was_not_fitted(
    plant, tmp_path
):
    """A gap that is crossed at every reversal. Dry friction is left out, whose sign at a reversal the identifier knows better."""
    result = identify(plant, "usual", ["backlash"], payloads=[plant.payloads[0].name])
    values = {"backlash": (2e-3, -3e-3), "coulomb": [0.0]}
    result = with_values(result, values, {"backlash": {"play": 4e-3}})
    file = plant.sessions[-1].file
    motion, torque, _ = along_the_record(result, file)
    _, without, _ = along_the_record(with_values(result, {"backlash": (0.0, 0.0)}, {}), file)
    assert np.abs(torque - without).max() > 1.0
    for name, torque_of in in_formats(exported_model(result), tmp_path).items():
        given = torque_of(motion)
        assert given[:-4] == pytest.approx(torque[:-4], rel=1e-9, abs=1e-8), name


@pytest.fixture(scope="module")
def bare(plant):
    """A model of one joint to put other torques into, and a payload of nothing."""
    nothing = next(each for each in plant.payloads if each.mass == 0)
    return exported_model(identify(plant, "usual")), nothing


def test_elasticity_is_a_rotor_that_drives_a_link_through_a_spring(bare):
    """Two masses along a sine, in closed form: the link swings at k q / (k - M w²) of the rotor's way."""
    model, nothing = bare
    rotor, link, omega = 0.3, 0.7, 8.0
    stiffness = link * (60.0 * omega) ** 2
    inertia = rotor + link
    motion = sine(nothing, np.arange(0.0, 1.0, 1e-4), omega)
    swing = stiffness / (stiffness - link * omega**2)
    exact = rotor * motion.ddq + link * swing * motion.ddq
    spring = [("elasticity", "-load", link**2 / (stiffness * inertia), 2)]
    stiff, soft = (one_inertia(model, inertia, torques) for torques in ([], spring))
    given = module_torque(module_of(soft), soft)(motion)
    largest = np.abs(exact - inertia * motion.ddq).max()
    assert np.abs(module_torque(module_of(stiff), stiff)(motion) - exact).max() == pytest.approx(largest)
    # second order in w²/w0², and differences instead of derivatives
    assert np.abs(given - exact)[3:-3].max() < 1e-3 * largest


def test_a_positive_delay_sets_the_torque_behind_its_motion_and_a_negative_one_ahead(bare):
    model, nothing = bare
    time = np.arange(0.0, 1.0, 1e-3)
    motion = sine(nothing, time)
    for delay in (2e-3, -2e-3):
        late = one_inertia(model, 1.5, [("delay", "-torque", delay, 1)])
        given = module_torque(module_of(late), late)(motion)
        shifted = 1.5 * sine(nothing, time - delay).ddq
        unshifted = np.abs(1.5 * motion.ddq - shifted).max()
        assert np.abs(given - shifted)[2:-2].max() < 0.02 * unshifted


def test_a_link_crosses_its_gap_as_every_format_says(bare, tmp_path):
    """Pushed by either flank, its place by a loop of our own; torque is what its second derivative makes."""
    model, nothing = bare
    motion = sine(nothing, np.arange(0.0, 2.0, 2e-3))
    gap = 0.05
    link = [motion.q[0, 0] - 0.5 * gap]
    for q in motion.q[1:, 0]:
        link.append(min(max(link[-1], q - 0.5 * gap), q + 0.5 * gap))
    place = (np.array(link) - motion.q[:, 0]) / gap
    assert np.ptp(place) == pytest.approx(1.0)
    expected = -0.2 * np.gradient(np.gradient(-place, 2e-3), 2e-3)
    formats = in_formats(with_play(one_inertia(model, 0.0, []), gap, -0.2), tmp_path, packed=False)
    for name, torque_of in formats.items():
        assert torque_of(motion)[:-4, 0] == pytest.approx(expected[:-4], rel=1e-8, abs=1e-8), name


def test_a_period_that_changes_and_a_new_beginning_are_followed_alike(with_derivatives, all_formats):
    """The motion is sampled at 1 ms and then at 3 ms; each format begins anew with every motion."""
    time = np.concatenate([np.arange(60) * 1e-3, 0.06 + np.arange(40) * 3e-3])
    payload = with_derivatives["all"].experiment.payloads[0]
    motion = sine(payload, time)
    _, formats = all_formats
    expected = formats["formulas"](motion)
    for name, torque_of in formats.items():
        for _ in range(2):
            assert torque_of(motion) == pytest.approx(expected, rel=1e-8, abs=1e-8), name


def test_python_cycle_by_cycle_is_the_torque_along_the_motion(with_derivatives, tmp_path):
    """Behind it by the latency; before that, the first motion's torque without what is differentiated."""
    model = exported_model(with_derivatives["all"])
    module = module_of(model)
    motion = sine(with_derivatives["all"].experiment.payloads[0], np.arange(80) * PERIOD)
    expected = module_torque(module, model)(motion)
    cycles = module.Cycles()
    for _ in range(2):
        cycles.begin()
        given = [
            cycles.torque(q, dq, ddq, PERIOD, t)
            for q, dq, ddq, t in zip(motion.q, motion.dq, motion.ddq, motion.t, strict=True)
        ]
        assert np.array(given[3:]) == pytest.approx(expected[:-3], rel=1e-9, abs=1e-9)
        first = module.torque_along(motion.q[:1].T, motion.dq[:1].T, motion.ddq[:1].T, motion.t[:1])[:, 0]
        assert np.array(given[:3]) == pytest.approx(np.array([first] * 3), rel=1e-12)
    (tmp_path / "arm.py").write_text(python_code(model))
    with python_torque(tmp_path / "arm.py") as torque_of:
        assert torque_of(motion) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_certificates_list_what_was_lost_as_kept_and_say_what_a_latency_is(with_derivatives, tmp_path):
    certificate = write_export(with_derivatives["all"], tmp_path / "arm.py")
    (joint,) = certificate.joints
    assert {"elasticity", "backlash", "delay"} <= set(joint.kept)
    assert joint.lost == ()
    assert joint.relative_difference < 1e-9
    assert any("3 cycles" in remark for remark in certificate.remarks)
    assert any(remark.startswith("delay") and "1.3 ms earlier" in remark for remark in certificate.remarks)


def test_what_has_no_history_leaves_effects_with_derivatives_out_whole(with_derivatives):
    model = exported_model(with_derivatives["all"]).of_the_instant
    assert {effect for effect, _ in model.lost} == {"elasticity", "backlash", "delay"}
    assert not {each.effect for each in model.torques} & {"elasticity", "backlash", "delay"}
    assert model.latency == 0
