"""The errors of simulated motion in the terminal: which figures stand where, with their units, and what drove the model."""

from __future__ import annotations

import pytest

from api.simulation_text import simulation_text
from identify.results.effect import EffectOnJoint
from identify.results.simulation import (
    ControllerUsed,
    EffectInSimulation,
    HorizonErrors,
    JointMotionError,
    SimulationDocument,
)
from identify.results.unseen_motion import JointUnseenMotion, UnseenMotionErrors


def joint(name="j1", unit="rad", windows=3, **more):
    figures = {"position_rms": 0.00125, "velocity_rms": 0.0375, "left_record_at": None, **more}
    return JointMotionError(joint=name, unit=unit, windows=windows, **figures)


def horizon(seconds, *joints, **more):
    figures = {
        "role": "identification",
        "sessions": (),
        "energy_drift": None,
        "simulated_seconds": 3.0,
        **more,
    }
    return HorizonErrors(horizon=seconds, joints=joints, **figures)


def document(*horizons, **more):
    fields = {"controller": None, "formed": (), "inputs": ("recorded torque",), "remarks": (), **more}
    return SimulationDocument(
        experiment="arm",
        model="usual",
        effects=(EffectOnJoint(effect="viscous", joint="j1"),),
        horizons=horizons,
        **fields,
    )


def lines(*horizons, **more):
    return [line.split() for line in simulation_text(document(*horizons, **more)).splitlines()]


def test_a_joint_s_errors_stand_in_a_row_with_their_units():
    slide = joint("slide", "m", position_rms=None, left_record_at=2.345)
    shown = lines(horizon(1.0, joint(), slide), horizon(None, joint(windows=1), role="validation"))
    assert ["arm,", "model", "usual,", "driven", "by", "the", "recorded", "torque:"] in shown
    assert ["1", "s", "ahead,", "identification", "sessions,", "3", "windows:"] in shown
    assert ["j1", "0.00125", "rad", "0.0375", "rad/s"] in shown
    assert [
        "slide",
        "–",
        "0.0375",
        "m/s",
        "a",
        "tenth",
        "of",
        "its",
        "range",
        "off",
        "at",
        "2.35",
        "s",
    ] in shown
    assert ["Free", "run", "from", "the", "start,", "validation", "sessions:"] in shown
    assert ["effects:", "viscous@j1"] in shown
    assert not any("usual" in line and "model:" in line for line in shown)


@pytest.mark.parametrize(("windows", "said"), [(1, "1 window:"), (2, "2 windows:")])
def test_one_window_is_not_several(windows, said):
    assert any(" ".join(line).endswith(said) for line in lines(horizon(0.5, joint(windows=windows))))


def test_the_usual_model_stands_beside_where_it_was_simulated_too():
    compared = joint(position_rms_usual=0.5, velocity_rms_usual=0.75)
    shown = lines(horizon(1.0, compared, joint("j2")))
    assert ["joint", "position", "speed", "usual", "model:", "position", "speed"] in shown
    assert ["j1", "0.00125", "rad", "0.0375", "rad/s", "0.5", "rad", "0.75", "rad/s"] in shown
    assert ["j2", "0.00125", "rad", "0.0375", "rad/s", "–", "–"] in shown


@pytest.mark.parametrize(
    ("model", "usual", "said"),
    [
        (2.345, 0.5, "a tenth of its range off: model at 2.35 s, usual model at 0.5 s"),
        (None, 0.5, "a tenth of its range off: usual model at 0.5 s"),
        (2.345, None, "a tenth of its range off: model at 2.35 s"),
        (None, None, "0.75 rad/s"),
    ],
)
def test_of_two_models_it_is_said_which_has_left_the_record_and_when(model, usual, said):
    compared = joint(
        position_rms_usual=0.5, velocity_rms_usual=0.75, left_record_at=model, left_record_at_usual=usual
    )
    (row,) = [" ".join(line) for line in lines(horizon(None, compared)) if line[:1] == ["j1"]]
    assert row.endswith(said)


def test_a_drift_of_energy_is_a_percentage_of_the_work():
    assert ["energy", "drift", "0.12", "%", "of", "the", "work", "done"] in lines(
        horizon(1.0, joint(), energy_drift=0.0012)
    )


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("file", "gains from a file"),
        ("estimated", "gains told from the record"),
        ("drives", "gains read from the drives before the sessions"),
    ],
)
def test_what_closed_the_loop_is_said(source, words):
    used = ControllerUsed(source=source, read_from=(), joints=())
    shown = simulation_text(document(horizon(1.0, joint()), controller=used))
    assert f"driven by its controllers ({words}):" in shown
    assert "sees its motor" not in shown
    motors = used.model_copy(update={"coordinates": "motors"})
    assert "each controller sees its motor, in units of its joint" in simulation_text(
        document(horizon(1.0, joint()), controller=motors)
    )


@pytest.mark.parametrize(
    ("unseen", "where"),
    [("validation", "validation sessions"), ("stretches", "stretches left out of the fit")],
)
def test_a_joint_that_got_worse_where_the_fit_did_not_see_is_named(unseen, where):
    joints = (
        JointUnseenMotion(joint="j1", position_rms=0.002, position_rms_before=0.001, unit="rad", worse=True),
        JointUnseenMotion(joint="j2", position_rms=0.001, position_rms_before=None, unit="m", worse=False),
    )
    errors = UnseenMotionErrors(horizon=2.0, unseen=unseen, windows=5, joints=joints)
    used = ControllerUsed(source="file", read_from=(), joints=())
    shown = lines(horizon(1.0, joint()), unseen=errors)
    assert f"2 s ahead where the fit did not see ({where}):".split() in shown
    assert [
        "j1",
        "0.002",
        "rad,",
        "usual",
        "model",
        "0.001",
        "rad",
        "worse",
        "than",
        "the",
        "usual",
        "model",
    ] in shown
    assert ["j2", "0.001", "m"] in shown
    text = simulation_text(document(horizon(1.0, joint()), unseen=errors, controller=used))
    assert f"({where}, driven by the recorded torque):" in text


def test_states_shifts_inputs_and_remarks_are_said():
    formed = (
        EffectInSimulation(
            effect="elasticity", joint="j1", formed="give", state="position and speed of the link"
        ),
        EffectInSimulation(effect="delay", joint="j1", formed="command", state=None),
        EffectInSimulation(effect="delay", joint="j2", formed="left-out", state=None),
        EffectInSimulation(effect="viscous", joint="j1", formed="instant", state=None),
    )
    text = simulation_text(document(horizon(1.0, joint()), formed=formed, remarks=("short record",)))
    assert "elasticity@j1: simulated with a state of its own, position and speed of the link" in text
    assert "delay@j1: shifts the recorded command in time" in text
    assert "delay@j2: left out\n" in text
    assert "viscous@j1: " not in text
    assert "Taken from the record after each start: recorded torque." in text
    assert "The measured motion gives the state at the start alone" in text
    assert text.endswith("Remark: short record")
