"""The identifier's model as the planner sees it, against the paper's own equation for one joint."""

import numpy as np
import pytest

from api.pages.catalogue_words import effect_titles
from api.pages.plan_view import findings
from api.plan_model import Identified, RegressorModel, usual_model
from daq.excitation import ExcitationPlan, Move, standard_plan
from daq.excitation.optimal_excitation import Request
from daq.excitation.plan_model import PlannedMotion
from daq.excitation.plan_report import judge
from daq.rig import Rig
from identify.recording.errors import InputError


@pytest.fixture(scope="module")
def motion(rig) -> PlannedMotion:
    return PlannedMotion.of(standard_plan(rig, 40.0), rig.payload("disk-7"), 0.02)


TABLE_1 = {"ZZ1R": 30.921, "MX1": 21.109, "MY1": 0.4, "FC1": 39.89, "FV1": 29.429, "offset1": 9.931}


def test_the_torque_of_the_usual_model_is_equation_34(rig, motion):
    """Table I's values with a payload of 6.97 kg at 1.277 m; MY has our frames' sign, −MY g sin q."""
    model = RegressorModel(rig, "usual", rig.payloads, identified=Identified(TABLE_1, "Table I"))
    q, dq, ddq = motion.q[:, 0], motion.dq[:, 0], motion.ddq[:, 0]
    g, mass, length = 9.81, 6.97, 1.277
    load = 30.921 * ddq + 21.109 * g * np.cos(q) - 0.4 * g * np.sin(q)
    load += mass * length * (length * ddq + g * np.cos(q))
    np.testing.assert_allclose(model.load(motion)[:, 0], load, atol=1e-9)
    torque = load + 39.89 * np.sign(dq) + 29.429 * dq + 9.931
    np.testing.assert_allclose(model.torque(motion)[:, 0], torque, atol=1e-9)


def test_effects_over_the_slope_of_the_load_and_a_tilt_can_be_planned_for(rig, motion):
    """Closed forms for one joint: elasticity's −τ_out ∂τ_out/∂q, and the moment of gravity across the declared direction."""
    additions = ["elasticity", "gravity-tilt"]
    model = RegressorModel(rig, "usual", rig.payloads, additions, Identified(TABLE_1, "Table I"))
    ((indices, columns),) = model.rows(motion)
    column = {model.parameters[index].name: columns[:, place] for place, index in enumerate(indices)}
    q, g = motion.q[:, 0], 9.81
    first, second = 21.109 + 6.97 * 1.277, 0.4
    load, slope = model.load(motion)[:, 0], -first * g * np.sin(q) - second * g * np.cos(q)
    np.testing.assert_allclose(column["compliance1"], -load * slope, rtol=1e-6, atol=1e-3)
    tilts = [np.abs(values) for name, values in column.items() if name.startswith("tilt")]
    across = np.abs(first * np.sin(q) + second * np.cos(q))
    assert min(np.abs(tilt - across).max() for tilt in tilts) < 1e-9


def test_parameters_have_the_names_units_and_values_that_identify_gives(rig):
    model = RegressorModel(rig, "usual", rig.payloads, identified=Identified(TABLE_1, "Table I"))
    assert {parameter.name: parameter.value for parameter in model.parameters} == TABLE_1
    assert [p.effect for p in model.parameters] == [None, None, None, "viscous", "coulomb", "offset"]


def test_six_coupled_axes_have_columns_on_every_row():
    rig = Rig.load("tx40-simulated")
    model = RegressorModel(rig, "rigid+viscous,coulomb,offset,coupled-friction", rig.payloads)
    plan = standard_plan(rig, 60.0)
    motion = PlannedMotion.of(plan, rig.payloads[2], 0.1)
    rows = model.rows(motion)
    names = [parameter.name for parameter in model.parameters]
    on_joint_5 = {names[k] for k in rows[4][0]}
    assert {"FV5", "FC5", "FVM6", "FCM6"} <= on_joint_5
    assert {"FVM6", "FCM6", "FV6"} <= {names[k] for k in rows[5][0]}
    torque = model.torque(motion)
    assert torque.shape == motion.q.shape
    assert np.isfinite(torque).all()


def test_a_motor_that_no_gain_matrix_declares_is_planned_for_both_of_its_joints():
    rig = Rig.load("tx40-simulated")
    model = RegressorModel(rig, "usual", rig.payloads, ["shared-motor-difference@j3"])
    motion = PlannedMotion.of(standard_plan(rig, 60.0), rig.payloads[2], 0.1)
    names = [parameter.name for parameter in model.parameters]
    on_rows = [{names[k] for k in row[0]} & {"FVD3", "FCD3"} for row in model.rows(motion)]
    assert on_rows == [set(), {"FVD3", "FCD3"}, {"FVD3", "FCD3"}, set(), set(), set()]


def test_friction_of_a_shared_motor_s_load_is_planned_on_every_row_that_it_turns():
    rig = Rig.load("tx40-simulated")
    model = RegressorModel(rig, "load-velocity", rig.payloads)
    random = np.random.default_rng(2)
    q, dq, ddq = random.uniform(-1, 1, (3, 40, 6))
    motion = PlannedMotion(rig.payloads[2], 0.01 * np.arange(40.0), q, dq, ddq, 0.01)
    rows = model.rows(motion)
    names = [parameter.name for parameter in model.parameters]
    columns = [dict(zip([names[k] for k in indices], part.T, strict=True)) for indices, part in rows]
    load = model.load(motion)
    # motor 5 carries joint 5 less what motor 6 brings to it; motor 6 turns with both
    for joint, carried, speed in (
        (5, load[:, 4] - load[:, 5], dq[:, 4]),
        (6, load[:, 5], dq[:, 4] + dq[:, 5]),
    ):
        both = columns[4][f"alpha_m{joint}"] + columns[4][f"alpha_g{joint}"]
        assert both == pytest.approx(np.abs(carried) * np.sign(speed), rel=1e-9)
    assert columns[5]["FS6"] == pytest.approx(columns[4]["FS6"])
    assert "alpha_m5" not in columns[5]


def test_a_result_file_of_another_robot_or_none_at_all_is_refused(rig, tmp_path):
    path = tmp_path / "result.json"
    other = Identified({"XX9": 1.0}, "identified: other, model usual")
    with pytest.raises(InputError, match="has no parameter 'ZZ1R'"):
        RegressorModel(rig, "usual", rig.payloads, identified=other)
    path.write_text('{"experiment": "other", "model": "usual"}')
    with pytest.raises(InputError, match=r"result\.json: not a result of `coulomb identify --json`: effects"):
        Identified.load(path)
    path.write_text("{]")
    with pytest.raises(InputError, match=r"result\.json, line 1: not JSON"):
        Identified.load(path)
    path.write_text("[1]")
    with pytest.raises(InputError, match="not a result of"):
        Identified.load(path)


def test_the_products_of_equation_30_give_their_mean(rig):
    products = {"a_m·ZZ1R": 32.42, "a_g·ZZ1R": 29.294, "a_m·MX1": 22.2, "a_g·MX1": 19.4, "a_m·MY1": 0.0}
    model = RegressorModel(rig, "rigid", rig.payloads, identified=Identified(products, "Table II"))
    assert model.parameters[0].value == pytest.approx(0.5 * (32.42 + 29.294))


def test_an_effect_that_needs_a_record_cannot_be_planned_for(rig):
    with pytest.raises(InputError, match="torque-ripple"):
        RegressorModel(rig, "usual", rig.payloads, ["torque-ripple"])


def hidden_for(rig, plan, payloads, values=TABLE_1, carried=()) -> dict[str, str]:
    """Reason by effect, of what sessions of a plan with these payloads do not show."""
    model = RegressorModel(rig, "usual", rig.payloads, identified=Identified(values, "Table I"))
    motions = [PlannedMotion.of(plan, payload, 0.02) for payload in payloads]
    return {
        effect: hidden.reason for hidden in model.judge(motions, carried).hidden for effect in hidden.effects
    }


def to_and_fro(way: float, speed: float, start: float = 0.0) -> ExcitationPlan:
    """Six moves at a steady speed, rad/s, between two positions that are `way` apart."""
    ramp = 0.6
    phases = tuple(
        Move(to=(start + (way if k % 2 == 0 else 0.0),), duration=way / speed + ramp, ramp=ramp)
        for k in range(6)
    )
    return ExcitationPlan(joints=("j3",), start=(start,), phases=phases)


def test_a_full_plan_with_payloads_shows_every_effect_but_those_of_temperature(rig):
    assert set(hidden_for(rig, standard_plan(rig, 61.0), rig.payloads)) == {"friction-temperature"}


def test_without_payload_change_load_friction_is_hidden_unless_another_payload_was_measured_before(rig):
    plan = standard_plan(rig, 61.0)
    hidden = hidden_for(rig, plan, rig.payloads[:1])
    assert hidden["load-friction"] == hidden["load-stribeck"] == "no payload change"
    assert hidden["payload-mass"] == "no session with a payload"
    assert "stribeck" not in hidden
    assert set(hidden_for(rig, plan, rig.payloads[:1], carried=[7.0])) == {"friction-temperature"}


def test_without_slow_motion_stribeck_is_hidden_and_without_fast_motion_drag(rig):
    fast = hidden_for(rig, to_and_fro(1.5, 1.1), rig.payloads)
    assert "no slow motion" in fast["stribeck"]
    assert "viscous-quadratic" not in fast
    slow = hidden_for(rig, to_and_fro(1.5, 0.05), rig.payloads)
    assert "no fast motion" in slow["viscous-quadratic"]


def test_a_load_of_one_sign_leaves_two_quadrants_empty(rig):
    always_up = TABLE_1 | {"ZZ1R": 0.1}
    reason = hidden_for(rig, to_and_fro(1.0, 0.8, start=-0.5), rig.payloads, always_up)
    assert "quadrants 3, 4" in reason["load-friction-asymmetric"]


def test_a_short_way_and_a_short_session_hide_what_acts_over_position_and_over_minutes(rig):
    hidden = hidden_for(rig, to_and_fro(0.4, 0.5), rig.payloads)
    assert "of the position range" in hidden["joint-spring"]
    assert "s only" in hidden["friction-warmup"]


def test_page_and_plan_report_say_the_same_of_the_same_plan_of_90_seconds(rig):
    plan, payload = standard_plan(rig, 90.0), rig.payloads[0]
    known = Identified(TABLE_1, "Table I")
    model = RegressorModel(rig, "usual", [payload], identified=known)
    report = judge(
        Request(rig=rig, model=model, payloads=(payload,), seconds=90.0, noise=np.array([2.0])), plan
    )
    shown = [finding.words for finding in findings(plan, rig, payload, [], model) if finding.kind == "warn"]
    assert len(shown) == len(report.hidden) > 0
    titles = effect_titles()
    for hidden, words in zip(report.hidden, shown, strict=True):
        assert f"{hidden.reason}. {hidden.remedy}.".lower() in words.lower()
        assert all(titles[effect].lower() in words.lower() for effect in hidden.effects)


def test_values_that_lack_a_base_parameter_of_the_robot_are_not_predicted_from(rig):
    payload = rig.payloads[0]
    assert usual_model(rig, payload, Identified(TABLE_1, "Table I")).is_identified
    for values in ({"FV1": 1.0}, {name: value for name, value in TABLE_1.items() if name != "MX1"}):
        assert not usual_model(rig, payload, Identified(values, "another robot")).is_identified
    assert not usual_model(rig, payload, None).is_identified
