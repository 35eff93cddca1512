"""Errors of predicted motion and certificates, as the pages say them."""

from types import SimpleNamespace
from typing import cast

import pytest

from api.pages.motion_table import (
    NAMES,
    MotionRow,
    certificate_words,
    driven_words,
    export_remarks,
    export_rows,
    figure,
    motion_panel,
    motion_table,
)
from api.service.job_documents import JobState
from api.service.jobs import Job
from api.service.model_use import ENDINGS, ModelUse
from identify.recording.errors import InputError
from identify.results.certificate import Certificate, JointCertificate
from identify.results.simulation import EffectInSimulation


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "–"),
        (0.0, "0 mrad"),
        (9.99e-6, "9.99 µrad"),
        (1e-5, "0.01 mrad"),
        (0.012345, "12.3 mrad"),
        (0.9994, "999 mrad"),
        (0.9999, "1.000 rad"),
        (2.0, "2.00 rad"),
        (1234.5, "1234 rad"),
    ],
)
def test_an_error_is_in_thousandths_where_that_is_little_in_millionths_and_where_it_is_much_whole(
    value, words
):
    assert figure(value, "rad") == words


def joint(name, position, speed, usual, usual_speed):
    return SimpleNamespace(
        joint=name,
        unit="rad",
        position_rms=position,
        velocity_rms=speed,
        position_rms_usual=usual,
        velocity_rms_usual=usual_speed,
    )


QUIET = ("simulation_fault", "simulating")


def model_use(**answers) -> ModelUse:
    """As far as a test asks it; no prediction failed, and none is under way."""
    return cast(ModelUse, SimpleNamespace(**{**dict.fromkeys(QUIET, lambda *of: None), **answers}))


@pytest.fixture
def document():
    """A simulation of two joints: half a second ahead in validation, and from the start in the fit's sessions."""
    first = (joint("j1", 9.0, 9.0, 9.0, 9.0), joint("j2", 1e-3, 2e-3, 3e-3, 4e-3))
    second = (joint("j2", 5e-3, 6e-3, None, None),)
    unseen = SimpleNamespace(joint="j2", unit="rad", position_rms=7e-3, position_rms_before=8e-3, worse=True)
    return SimpleNamespace(
        horizons=[
            SimpleNamespace(role="validation", horizon=0.5, joints=first, energy_drift=0.01),
            SimpleNamespace(role="identification", horizon=None, joints=second, energy_drift=0.0234),
            SimpleNamespace(role="identification", horizon=2.0, joints=second, energy_drift=None),
        ],
        unseen=SimpleNamespace(horizon=1.0, unseen="stretches", joints=[unseen]),
        controller=None,
        remarks=["delay is left out"],
        inputs=("recorded torque",),
        formed=(
            EffectInSimulation(effect="presliding", joint="j2", formed="state", state="share built up"),
            EffectInSimulation(effect="presliding", joint="j1", formed="state", state="share built up"),
            EffectInSimulation(effect="viscous", joint="j2", formed="instant", state=None),
        ),
    )


def test_a_joint_has_a_row_for_each_horizon_with_the_usual_model_beside_it(document):
    rows = motion_table(document, "j2")
    assert [row.words for row in rows] == [
        "0.5 s ahead, validation sessions",
        "free run from the start, sessions of the fit",
        "2 s ahead, sessions of the fit",
        "1 s ahead, motion that the fit did not see (stretches left out of the fit)",
    ]
    assert rows[0] == MotionRow(
        words="0.5 s ahead, validation sessions",
        error="1 mrad",
        usual="3 mrad",
        speed="2 mrad/s",
        usual_speed="4 mrad/s",
        worse=False,
    )
    assert (rows[1].usual, rows[1].usual_speed) == ("–", "–")
    assert [row.worse for row in rows] == [False, False, False, True]
    assert (rows[3].error, rows[3].usual, rows[3].speed) == ("7 mrad", "8 mrad", None)
    document.unseen = None
    assert len(motion_table(document, "j2")) == 3


def test_what_drove_the_model_and_the_greatest_drift_of_energy_are_said(document):
    assert driven_words(document, "j2") == [
        "Driven by the recorded torque.",
        "Taken from the record after each start: recorded torque.",
        "presliding@j2: simulated with a state of its own, share built up.",
        "Energy drift of the integration: at most 2.3\u202f% of the work done.",
        "Delay is left out.",
    ]
    document.controller = SimpleNamespace(source="estimated")
    document.horizons[0].energy_drift, document.horizons[1].energy_drift = 9.5e-5, None
    assert "at most 0.0095\u202f% of" in driven_words(document, "j1")[-2]
    document.horizons, document.inputs = document.horizons[2:], ()
    assert driven_words(document, "j3") == [
        "In closed loop, gains told from the record.",
        "Delay is left out.",
    ]


def test_figures_that_cannot_be_read_hide_no_page(document):
    def unreadable(experiment, version):
        raise InputError("simulation.json: is damaged")

    panel = motion_panel(model_use(simulation=unreadable), "arm", "m2", "j2")
    assert panel["motion_rows"] is None
    assert panel["motion_problem"].startswith("The figures of the last simulation cannot be read")
    assert panel["motion_link"].endswith("arm/use/simulation?version=m2")
    assert motion_panel(model_use(simulation=lambda *of: None), "arm", "m2", "j2")["motion_problem"] == ""
    shown = motion_panel(model_use(simulation=lambda *of: document), "arm", "m2", "j2")
    assert len(shown["motion_rows"]) == 4
    assert shown["motion_beside_usual"]
    assert (panel["motion_horizons"], shown["motion_horizons"]) == ("0.1, 1", "0.5, 2")
    assert shown["motion_job"] is None
    document.unseen = None
    for errors in document.horizons:
        for joint in errors.joints:
            joint.position_rms_usual = joint.velocity_rms_usual = None
    alone = motion_panel(model_use(simulation=lambda *of: document), "arm", "m2", "j2")
    assert not alone["motion_beside_usual"]


CERTIFICATE = Certificate(
    target="arm.urdf",
    kind="URDF",
    experiment="e",
    model="usual",
    joints=(
        JointCertificate(
            joint="j1",
            kept=("rigid body",),
            approximated=("load-friction",),
            lost=("offset", "cogging"),
            relative_error_model=0.04,
            relative_error_export=0.05,
        ),
    ),
    checked_with="the file read back",
    remarks=("a URDF does not say which way gravity points", "payload-mass was estimated"),
)


def test_a_certificate_is_said_in_sentences():
    assert certificate_words(CERTIFICATE) == [
        "Checked with the file read back.",
        "j1: relative error of the model 4.00\u202f%, of the file 5.00\u202f%; approximated: load-friction; "
        "lost: offset, cogging.",
        "A URDF does not say which way gravity points.",
        "Payload-mass was estimated.",
    ]
    (joint,) = CERTIFICATE.joints
    unmeasured = CERTIFICATE.changed(
        joints=(joint.changed(relative_error_export=None),), not_measured="there is no C compiler"
    )
    assert certificate_words(unmeasured)[:2] == [
        "Not measured: there is no C compiler.",
        "j1: relative error of the model 4.00\u202f%, of the file not measured; approximated: load-friction; "
        "lost: offset, cogging.",
    ]
    whole = joint.changed(relative_error_model=None, approximated=(), lost=())
    assert certificate_words(CERTIFICATE.changed(joints=(whole,)))[1] == "j1: everything kept."


UNDER_WAY = Job("5f1c", "export", "arm", "ada", JobState.RUNNING, 0.25, "writing", 0.0)


def test_a_prediction_under_way_is_followed_in_place_of_the_form(document):
    panel = motion_panel(
        model_use(simulation=lambda *of: document, simulating=lambda *of: UNDER_WAY), "arm", "m2", "j2"
    )
    assert panel["motion_job"]["poll_link"].endswith("arm/use/progress?job=5f1c")
    assert panel["motion_job"]["fraction"] == 0.25


def test_what_all_formats_say_alike_is_said_once():
    other = CERTIFICATE.changed(
        target="arm.c", kind="C source", remarks=("payload-mass was estimated", "needs C99")
    )
    faults = {"sdf": "the disk is full"}
    use = model_use(
        certificates=lambda experiment, version: {"urdf": CERTIFICATE, "c": other},
        export_faults=lambda experiment, version: faults,
        exporting=lambda experiment, version: {"fmu": UNDER_WAY},
    )
    assert export_remarks(use, "arm", "m1") == ["Payload-mass was estimated."]
    rows = {row.ending: row for row in export_rows(use, "arm", "m1")}
    assert list(rows) == list(ENDINGS)
    assert {ending: row.name for ending, row in rows.items()} == NAMES
    assert "TwinCAT" in rows["st"].purpose
    assert all(row.purpose for row in rows.values())
    assert rows["c"].words is not None
    assert rows["urdf"].words is not None
    assert rows["c"].words[2:] == ["Needs C99."]
    assert rows["urdf"].words[2:] == ["A URDF does not say which way gravity points."]
    assert rows["py"].words is None
    assert (rows["c"].certificate, rows["c"].certificate_file) == (
        "/experiments/arm/models/m1/exports/c",
        "arm.c.certificate.json",
    )
    assert rows["py"].certificate_file is None
    assert {ending: row.job["fraction"] for ending, row in rows.items() if row.job} == {"fmu": 0.25}
    assert {ending: row.fault for ending, row in rows.items() if row.fault} == faults
    assert rows["py"].link.endswith("arm/use/exports/py?version=m1")
    alone = model_use(certificates=lambda experiment, version: {"urdf": CERTIFICATE})
    assert export_remarks(alone, "arm", "m1") == []
