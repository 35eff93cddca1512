"""Experiments as the service keeps them, with two models of the usual size, for benchmarks of its pages; nothing is fitted."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import yaml

from api.service.model_story import Fit, ModelStory, data_fingerprint, now_text
from api.service.prediction_files import write_candidate, write_prediction
from daq.experiment_folder import experiment_robot
from daq.recording_file import RecordingFile, SessionDescription
from daq.rig import Rig
from daq.samples import sample_dtype
from identify.effects.catalogue import effects
from identify.recording import Payload
from identify.results.diagnosis import Candidate, DiagnosisDocument, JointDiagnosis
from identify.results.effect import EffectOnJoint
from identify.results.identification import IdentificationDocument, JointError, Parameter, SessionError

CANDIDATES = ("stribeck", "load-friction", "viscous-power", "backlash", "presliding", "delay")
SHORT_SESSION = 6000  # samples of a fit, of 60 s
SIX_JOINTS = "tx40-simulated"


@dataclass(frozen=True)
class Stored:
    """An experiment: its sessions are a payload and the samples of a fit each, by file."""

    name: str
    robot: dict
    joints: list[str]
    sessions: dict[str, tuple[str, int]]


def long_session(samples: int) -> Stored:
    """One joint, and one session so long beside two short ones."""
    robot = {
        "gravity": [0.0, -9.81, 0.0],
        "joints": [{"name": "j1", "type": "revolute", "drive_gain": 35.15}],
    }
    short = {f"session-0{number}.csv": ("disk", SHORT_SESSION) for number in (1, 2)}
    return Stored("million", robot, ["j1"], {"session-00.csv": ("none", samples)} | short)


def many_sessions(sessions: int) -> Stored:
    """Six joints, and so many recordings of 60 s."""
    robot = experiment_robot(Rig.load(SIX_JOINTS)).model_dump(mode="json", exclude_none=True)
    files = {
        f"session-{number:02}.h5": ("disk" if number % 2 else "none", SHORT_SESSION)
        for number in range(sessions)
    }
    return Stored("arm", robot, [each["name"] for each in robot["joints"]], files)


def write_experiment(folder: Path, stored: Stored) -> None:
    """The experiment's folder with its sessions and both models."""
    folder.mkdir(parents=True)
    declared = {
        "format": 1,
        "name": stored.name,
        "robot": stored.robot,
        "payloads": [
            {"name": "none", "mass": 0.0},
            {"name": "disk", "mass": 3.4584, "com": [0.1, 0.0, 0.0]},
        ],
        "sessions": [{"file": file, "payload": payload} for file, (payload, _) in stored.sessions.items()],
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(declared))
    recorded: Path | None = None
    for file, (payload, _) in stored.sessions.items():
        if file.endswith(".csv"):
            (folder / file).write_text("t,q1,v1\n0,0,0\n0.001,0,0\n")
        elif recorded is None:
            recorded = folder / file
            write_recording(recorded, payload)
        else:
            shutil.copyfile(recorded, folder / file)
    story = ModelStory(folder)
    add = [f"stribeck@{stored.joints[0]}"]
    for number, noise in enumerate((8.0, 3.0), start=1):
        write_fit(story.new_fit_folder(f"m{number}", "f1"), stored, noise)
        fit = Fit(
            id="f1",
            data=data_fingerprint(folder),
            sessions=len(stored.sessions),
            created=now_text(),
            relative_error=noise / 100,
            relative_error_validation=None,
        )
        if number == 1:
            story.add_version(model="usual", add=[], cause="fit", change=None, user="benchmark", fit=fit)
        else:
            story.add_version(
                model="usual", add=add, cause="effect added", change=add[0], user="benchmark", fit=fit
            )
        story.store_diagnosis(f"m{number}", diagnosis(stored, noise / 100, CANDIDATES[number - 1 :]))


def write_fit(folder: Path, stored: Stored, noise: float) -> None:
    """What a fit and a diagnosis leave in its folder; all joints move alike."""
    folder.mkdir(parents=True)
    motions: dict[int, SimpleNamespace] = {}
    for index, (_, samples) in enumerate(stored.sessions.values()):
        of_session = motions.setdefault(samples, motion(samples, noise))
        closer = of_session.predicted + 0.3 * (of_session.measured - of_session.predicted)
        for joint in range(len(stored.joints)):
            write_prediction(folder, index, joint, of_session)
            for rank in range(1, 1 + len(CANDIDATES)):
                write_candidate(folder, index, joint, rank, closer)
    (folder / "identification.json").write_text(document(stored, noise / 100).json_text())


def write_recording(file: Path, payload: str) -> None:
    """A recording of 60 s, in which every axis follows a sine."""
    rig = Rig.load(SIX_JOINTS)
    axes = len(rig.axes)
    rows = np.zeros(round(60.0 / rig.cycle), sample_dtype(axes))
    rows["cycle"] = np.arange(len(rows))
    rows["sync_time"] = np.rint(1e9 * rig.cycle * rows["cycle"])
    rows["position"] = np.rint(1e5 * np.sin(1e-3 * rows["cycle"]))[:, None]
    rows["command"] = np.rint(300.0 * np.cos(1e-3 * rows["cycle"]))[:, None]
    rows["valid"] = 3
    described = SessionDescription(
        rig, {"name": "sweep"}, Payload(name=payload, mass=0.0), "ada", "monotonic"
    )
    recording = RecordingFile(file, described)
    recording.append(rows)
    recording.finish("complete", "the plan was run", {}, "plan")


def motion(samples: int, noise: float) -> SimpleNamespace:
    """A sum of sinusoids at 1 kHz and its torque with white noise."""
    t = np.arange(samples) * 1e-3
    q = 0.8 * np.sin(0.7 * t) + 0.3 * np.sin(2.3 * t)
    dq, ddq = np.gradient(q, t), np.gradient(np.gradient(q, t), t)
    load = 30 * ddq + 150 * np.sin(q)
    predicted = load + 20 * np.sign(dq) + 40 * dq
    error = noise * np.random.default_rng(1).normal(size=samples)
    return SimpleNamespace(
        time=t,
        position=q,
        velocity=dq,
        acceleration=ddq,
        load=load,
        measured=predicted + error,
        predicted=predicted,
        moving=np.ones(samples, bool),
        temperature=None,
    )


def document(stored: Stored, error: float) -> IdentificationDocument:
    """What a fit found, of the usual size."""
    return IdentificationDocument(
        experiment=stored.name,
        model="usual",
        effects=tuple(
            EffectOnJoint(effect=name, joint=joint)
            for joint in stored.joints
            for name in ("viscous", "coulomb", "offset")
        ),
        relative_error=error,
        relative_error_validation=None,
        joints=tuple(
            JointError(joint=joint, relative_error=error, relative_error_validation=None, noise_floor=0.01)
            for joint in stored.joints
        ),
        sessions=tuple(
            SessionError(file=file, payload=payload, role="identification", relative_error=error)
            for file, (payload, _) in stored.sessions.items()
        ),
        parameters=tuple(
            Parameter(
                name=name,
                joint=joint,
                value=30.9,
                std=0.14,
                std_robust=0.4,
                relative_std_percent=0.46,
                unit="kg m^2",
                grouping=None,
            )
            for number, joint in enumerate(stored.joints, start=1)
            for name in (f"ZZ{number}R", f"MX{number}", f"MY{number}", f"FV{number}", f"FC{number}")
        ),
        condition_number=31.2,
        samples=sum(samples for _, samples in stored.sessions.values()),
        form="linear",
        estimator="ordinary",
        eliminated=(),
        constants=(),
        relative_error_left_out=None,
        payloads=(),
        speeds=(),
        signals=(),
        not_identifiable=(),
        remarks=(),
    )


def diagnosis(stored: Stored, error: float, names: tuple[str, ...]) -> DiagnosisDocument:
    """What a diagnosis found, of the usual size."""
    candidates = tuple(
        Candidate(
            effect=name,
            rank=rank,
            relative_error_before=error,
            relative_error_after=error * (0.4 + 0.1 * rank),
            heldout_error_before=error,
            heldout_error_after=error * (0.4 + 0.1 * rank),
            p_value=10.0 ** (rank - 12),
            justified=True,
            indistinguishable_from=(),
            caution=None,
            explanation="Friction grows with the load that the gear carries.",
            equation=effects()[name].equation,
            variable=effects()[name].variable,
            constants={},
        )
        for rank, name in enumerate(names, start=1)
    )
    joints = tuple(
        JointDiagnosis(
            joint=joint,
            verdict="missing",
            missing=names[:1],
            candidates=candidates,
            evidence=candidates[:1],
            where=(),
            noise_floor=0.01,
            structure=(),
            superfluous=(),
        )
        for joint in stored.joints
    )
    return DiagnosisDocument(
        experiment=stored.name,
        model="usual",
        relative_error=error,
        relative_error_with_missing=0.5 * error,
        noise_floor=0.01,
        joints=joints,
        not_applicable=(),
    )
