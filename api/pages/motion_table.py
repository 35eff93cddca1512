"""What the pages show of a model's use: errors of predicted motion by horizon, exports with their certificates in words."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal
from urllib.parse import urlencode

from api.pages.job_views import polled_progress
from api.pages.layout import experiment_link
from api.pages.number_format import THIN, significant
from api.pages.rendering import Context
from api.pages.sentence import sentence
from api.service.model_use import ENDINGS, Driven, Ending, ModelUse
from api.simulation_text import GAINS, formed_words, input_words, unseen_words
from identify.recording.errors import InputError
from identify.results.certificate import Certificate
from identify.results.simulation import HORIZONS, SimulationDocument

NAMES: dict[Ending, str] = {
    "urdf": "URDF",
    "sdf": "SDF",
    "xml": "MJCF",
    "py": "Python",
    "c": "C",
    "st": "structured text",
    "fmu": "FMU",
    "json": "data (JSON)",
}

PURPOSES: dict[Ending, str] = {
    "urdf": "ROS, Pinocchio",
    "sdf": "Gazebo, Drake",
    "xml": "MuJoCo",
    "py": "a script with NumPy",
    "c": "a controller in C or C++",
    "st": "a PLC: CODESYS, TwinCAT",
    "fmu": "Modelica, Simulink (FMI 3.0)",
    "json": "programs of your own",
}
"""whom each format is for, beside its button"""

CHOICES: tuple[tuple[Driven | Literal["file"], str], ...] = (
    ("known", "in closed loop if its gains are known"),
    ("torque", "by the recorded torque"),
    ("drives", "in closed loop, gains read from the drives"),
    ("estimate", "in closed loop, gains told from the record"),
    ("file", "in closed loop, gains from a file"),
)


NO_FIGURE = "–"


@dataclass(frozen=True)
class MotionRow:
    """What is predicted how far ahead, and the errors with their units; of unseen motion none of speed."""

    words: str
    error: str
    usual: str
    speed: str | None
    usual_speed: str | None
    worse: bool
    """than without the last effect"""


@dataclass(frozen=True)
class ExportRow:
    """A format: its name, whom it is for, where to ask for it, and its certificate in sentences where the file is there."""

    name: str
    purpose: str
    ending: str
    link: str
    words: list[str] | None
    certificate: str
    """where REST has its certificate"""
    certificate_file: str | None
    """what that is called beside the file, where the file is there"""
    fault: str | None
    """why it could not be made the last time, if so"""
    job: Context | None
    """how far the file is that is being made, if so"""


def motion_table(document: SimulationDocument, joint: str) -> list[MotionRow]:
    """Rows of one joint: what is predicted how far ahead, the model's error and the usual one's, of position and of speed, in
    mrad or mm and a second."""
    rows: list[MotionRow] = []
    for errors in document.horizons:
        of_joint = next(each for each in errors.joints if each.joint == joint)
        sessions = "validation sessions" if errors.role == "validation" else "sessions of the fit"
        ahead = "free run from the start" if errors.horizon is None else f"{errors.horizon:g} s ahead"
        rows.append(
            MotionRow(
                words=f"{ahead}, {sessions}",
                error=figure(of_joint.position_rms, of_joint.unit),
                usual=figure(of_joint.position_rms_usual, of_joint.unit),
                speed=figure(of_joint.velocity_rms, f"{of_joint.unit}/s"),
                usual_speed=figure(of_joint.velocity_rms_usual, f"{of_joint.unit}/s"),
                worse=False,
            )
        )
    if document.unseen is not None:
        unseen = next(each for each in document.unseen.joints if each.joint == joint)
        rows.append(
            MotionRow(
                words=f"{document.unseen.horizon:g} s ahead, motion that the fit did not see"
                f" ({unseen_words(document.unseen, document)})",
                error=figure(unseen.position_rms, unseen.unit),
                usual=figure(unseen.position_rms_before, unseen.unit),
                speed=None,
                usual_speed=None,
                worse=unseen.worse,
            )
        )
    return rows


def figure(value: float | None, unit: str) -> str:
    """An error of position or of speed with its unit: in thousandths, a small one in millionths, a large one whole."""
    if value is None:
        return NO_FIGURE
    if value >= 0.9995:
        return f"{significant(value)} {unit}"
    return f"{1e6 * value:.3g} µ{unit}" if 0.0 < value < 1e-5 else f"{1e3 * value:.3g} m{unit}"


def motion_panel(use: ModelUse, experiment: str, version: str, joint: str) -> Context:
    """Context of the panel: the rows with what drove the model, and where to ask for them."""
    document, problem = None, ""
    try:
        document = use.simulation(experiment, version)
    except InputError:  # figures that can be computed again hide no page
        problem = "The figures of the last simulation cannot be read; predict the motion again."
    query = urlencode({"version": version})
    rows = None if document is None else motion_table(document, joint)
    job = use.simulating(experiment, version)
    horizons = () if document is None else [each.horizon for each in document.horizons]
    return {
        "motion_rows": rows,
        "motion_beside_usual": any(row.usual != NO_FIGURE for row in rows or ()),
        "motion_driven": None if document is None else driven_words(document, joint),
        "motion_problem": problem,
        "motion_fault": use.simulation_fault(experiment, version),
        "motion_link": f"{experiment_link(experiment, 'use/simulation')}?{query}",
        "motion_choices": CHOICES,
        "motion_horizons": ", ".join(
            f"{seconds:g}" for seconds in dict.fromkeys(horizons) or HORIZONS if seconds is not None
        ),
        "motion_job": None
        if job is None
        else polled_progress(job, experiment_link(experiment, "use/progress")),
    }


def driven_words(document: SimulationDocument, joint: str) -> list[str]:
    """What drove the model, what is a state of it on this joint, and what else is to be known of it, in sentences."""
    driven = "Driven by the recorded torque."
    if document.controller is not None:
        driven = f"In closed loop, {GAINS[document.controller.source]}."
    drifts = [errors.energy_drift for errors in document.horizons if errors.energy_drift is not None]
    drift = (
        [
            f"Energy drift of the integration: at most {significant(100 * max(drifts), 2)}{THIN}% of the work done."
        ]
        if drifts
        else []
    )
    inputs = [input_words(document)] if document.inputs else []
    formed = [formed_words(each) for each in document.formed if each.joint == joint]
    states = [sentence(each) for each in formed if each is not None]
    return [driven, *inputs, *states, *drift, *(sentence(remark) for remark in document.remarks)]


def export_rows(use: ModelUse, experiment: str, version: str) -> list[ExportRow]:
    """Every format: its name, where to ask for it, and the file with its certificate in words where it is there."""
    certificates = use.certificates(experiment, version)
    faults = use.export_faults(experiment, version)
    jobs = use.exporting(experiment, version)
    shared = _shared(certificates.values())
    query = urlencode({"version": version})
    return [
        ExportRow(
            name=NAMES[ending],
            purpose=PURPOSES[ending],
            ending=ending,
            link=f"{experiment_link(experiment, 'use/exports')}/{ending}?{query}",
            words=(certificate_words(certificates[ending], shared) if ending in certificates else None),
            certificate=f"/experiments/{experiment}/models/{version}/exports/{ending}",
            certificate_file=(
                f"{certificates[ending].target}.certificate.json" if ending in certificates else None
            ),
            fault=faults.get(ending),
            job=polled_progress(jobs[ending], experiment_link(experiment, "use/progress"))
            if ending in jobs
            else None,
        )
        for ending in ENDINGS
    ]


def export_remarks(use: ModelUse, experiment: str, version: str) -> list[str]:
    """What the certificates of all formats that are there say alike, in sentences."""
    return [sentence(remark) for remark in _shared(use.certificates(experiment, version).values())]


def _shared(certificates: Collection[Certificate]) -> list[str]:
    """Remarks that several certificates have, each of them."""
    if len(certificates) < 2:
        return []
    first, *others = certificates
    return [remark for remark in first.remarks if all(remark in other.remarks for other in others)]


def certificate_words(certificate: Certificate, but: Collection[str] = ()) -> list[str]:
    """A certificate in sentences.

    but : remarks that are said elsewhere
    """
    reason = certificate.not_measured
    said = [f"Checked with {certificate.checked_with}." if reason is None else f"Not measured: {reason}."]
    for joint in certificate.joints:
        model, file = joint.relative_error_model, joint.relative_error_export
        of_file = "not measured" if file is None else f"{100 * file:.2f}{THIN}%"
        errors = (
            ""
            if model is None
            else f" relative error of the model {100 * model:.2f}{THIN}%, of the file {of_file};"
        )
        parts = [
            f"{what} {', '.join(effects)}"
            for what, effects in (("approximated:", joint.approximated), ("lost:", joint.lost))
            if effects
        ]
        said.append(f"{joint.joint}:{errors} {'; '.join(parts) or 'everything kept'}.")
    return [*said, *(sentence(remark) for remark in certificate.remarks if remark not in but)]
