"""A laboratory for the pages without a bus: one joint like the paper's, three payloads, fitted by plain least squares.

The torque is computed from the load- and velocity-dependent friction of eq. (25) with the values of Table II, the models
are fitted here by `numpy.linalg.lstsq`, and what they return are documents of `identify.results`.
"""

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest
import yaml

from api.application import create_application
from api.pages.stored_models import Experiments
from api.service.model_documents import Fit
from api.service.model_story import IDENTIFICATION_FILE, ModelStory, data_fingerprint, now_text
from api.service.prediction_files import write_prediction
from api.service.settings import ServiceSettings
from identify.effects.catalogue import effects
from identify.recording.experiment_file import read_experiment_file
from identify.results.diagnosis import Candidate, DiagnosisDocument, JointDiagnosis, Verdict, Where
from identify.results.effect import EffectOnJoint
from identify.results.identification import (
    IdentificationDocument,
    JointError,
    Parameter,
    PayloadError,
    PriorComparison,
    PriorParameter,
    SessionError,
)
from tests.api.conftest import ADDRESS, Clock, RunningService, TestClient
from tests.api.served import served

JOINT = "j3"
PAYLOADS = {
    "session-00.csv": ("none", 0.0),
    "session-01.csv": ("disk 3.5 kg", 3.4584),
    "session-02.csv": ("disk 7 kg", 6.97),
}
GRAVITY = 9.81
ARM = 1.277  # m, joint to payload
CATALOGUE_WORDS = {
    "load-friction-asymmetric": "The dry friction grows with the load that the gear carries, and it grows more when the "
    "motor drives the load than when the load drives the motor. Worm, harmonic and cycloidal gears do this. "
    "Look at the lubrication and at the preload of the gear.",
    "load-friction": "The dry friction grows with the load that the gear carries, alike in both directions of power flow.",
    "stribeck": "Friction falls when the joint begins to slide and the lubricant film builds up.",
    "viscous-asymmetric": "Viscous friction differs between the two directions of motion.",
    "friction-warmup": "Friction falls while the gear warms up during the session.",
}


@dataclass
class SampleIdentification:
    """What `identify.identify` returns, as far as the pages use it."""

    effects: tuple[EffectOnJoint, ...]
    columns: dict[str, np.ndarray]
    motion: dict[str, Any]
    measured: np.ndarray
    model: str = "usual"
    fitted: np.ndarray = field(init=False)
    parameters: dict[str, tuple[float, float]] = field(init=False)

    def __post_init__(self) -> None:
        W = np.stack(list(self.columns.values()), axis=1)
        chi, *_ = np.linalg.lstsq(W, self.measured, rcond=None)
        self.fitted = W @ chi
        rest = self.measured - self.fitted
        variance = float(rest @ rest) / (len(rest) - W.shape[1])
        deviations = np.sqrt(variance * np.diag(np.linalg.inv(W.T @ W)))
        self.condition = float(np.linalg.cond(W / np.linalg.norm(W, axis=0)))
        self.parameters = {
            name: (float(value), float(std))
            for name, value, std in zip(self.columns, chi, deviations, strict=True)
        }

    def _rows(self, file: str) -> np.ndarray:
        return self.motion["session"] == list(PAYLOADS).index(file)

    def _relative(self, rows: np.ndarray) -> float:
        return float(
            np.linalg.norm((self.measured - self.fitted)[rows]) / np.linalg.norm(self.measured[rows])
        )

    def prediction(self, file: str, joint: str) -> SimpleNamespace:
        assert joint == JOINT
        rows = self._rows(file)
        names = ("time", "position", "velocity", "acceleration", "load")
        return SimpleNamespace(
            **{name: self.motion[name][rows] for name in names},
            measured=self.measured[rows],
            predicted=self.fitted[rows],
            moving=np.ones(int(rows.sum()), bool),
            temperature=None,
        )

    def document(self) -> IdentificationDocument:
        everything = np.ones(len(self.measured), bool)
        error = self._relative(everything)
        groupings = {"ZZ1R": "ZZ1 + Ia1", "MX1": "MX1", "payload ratio": "M_ae / M_aw, eq. (35)"}
        units = {"ZZ1R": "kg m^2", "MX1": "kg m", "FC": "N m", "FV": "N m s/rad", "offset": "N m"}
        return IdentificationDocument(
            experiment="rx130l-joint3",
            model=self.model,
            effects=self.effects,
            relative_error=error,
            relative_error_validation=error * 1.06,
            joints=(
                JointError(
                    joint=JOINT,
                    relative_error=error,
                    relative_error_validation=error * 1.06,
                    noise_floor=0.021,
                ),
            ),
            sessions=tuple(
                SessionError(
                    file=file,
                    payload=payload,
                    role="identification",
                    relative_error=self._relative(self._rows(file)),
                )
                for file, (payload, _) in PAYLOADS.items()
            ),
            parameters=tuple(
                Parameter(
                    name=name,
                    joint=JOINT,
                    value=value,
                    std=std,
                    std_robust=2.7 * std,
                    relative_std_percent=abs(100 * std / value),
                    unit=units.get(name, "–"),
                    grouping=groupings.get(name),
                )
                for name, (value, std) in self.parameters.items()
            ),
            condition_number=self.condition,
            samples=len(self.measured),
            form="linear",
            estimator="ordinary",
            eliminated=(),
            constants=(),
            relative_error_left_out=None,
            payloads=tuple(
                PayloadError(
                    payload=payload,
                    mass=mass,
                    role="identification",
                    relative_error=self._relative(self._rows(file)),
                )
                for file, (payload, mass) in PAYLOADS.items()
            ),
            speeds=(),
            signals=(),
            not_identifiable=(),
            remarks=(),
            prior=self._prior(),
        )

    def _prior(self) -> PriorComparison:
        """As if the experiment had been made with a file whose first moment is wrong."""
        value, std = self.parameters["MX1"]
        rows = [
            PriorParameter(
                name=name,
                joint=JOINT,
                unit=unit,
                by_file=by_file,
                identified=self.parameters[name][0],
                std_robust=2.7 * self.parameters[name][1],
                deviations=(self.parameters[name][0] - by_file) / (2.7 * self.parameters[name][1]),
                rotor=rotor,
            )
            for name, unit, by_file, rotor in (
                ("ZZ1R", "kg m^2", 28.5, True),
                ("MX1", "kg m", value - 20 * std, False),
            )
        ]
        return PriorComparison(
            file="arm.urdf", parameters=tuple(rows), remarks=("identified differently: MX1",)
        )

    @property
    def relative_error(self) -> float:
        return self._relative(np.ones(len(self.measured), bool))


def _motion(rate: float = 100.0, seconds: float = 60.0) -> dict[str, np.ndarray]:
    """Sinusoids and slow trapezoids, the same in each of the three sessions."""
    t = np.arange(int(rate * seconds)) / rate
    fast = 0.62 * np.sin(0.9 * t) + 0.34 * np.sin(1.83 * t + 0.4)
    slow = 0.9 * np.sin(0.09 * t)
    weight = 1 / (1 + np.exp(-(t - 36) / 1.5))
    q = (1 - weight) * fast + weight * slow
    dq = np.gradient(q, t)
    ddq = np.gradient(dq, t)
    sessions = len(PAYLOADS)
    return {
        "session": np.repeat(np.arange(sessions), len(t)),
        "time": np.tile(t, sessions),
        "position": np.tile(q, sessions),
        "velocity": np.tile(dq, sessions),
        "acceleration": np.tile(ddq, sessions),
        "mass": np.repeat([mass for _, mass in PAYLOADS.values()], len(t)),
    }


def make_models() -> dict[str, SampleIdentification]:
    """Three model versions of the same sessions, each with one effect more."""
    motion = _motion()
    q, dq, ddq, mass = motion["position"], motion["velocity"], motion["acceleration"], motion["mass"]
    arm = mass * ARM * (ARM * ddq + GRAVITY * np.sin(q))
    load = 33.0 * ddq + 15.0 * GRAVITY * np.sin(q) + 2.0 * GRAVITY * np.cos(q) + arm
    motion["load"] = load
    power = np.sign(load * dq)
    expo = np.exp(-np.abs(dq) / 0.04)
    motor, generator = (power > 0).astype(float), (power < 0).astype(float)
    friction = motor * (0.09 + 0.24 * expo) * np.abs(load) + generator * (0.05 + 0.2 * expo) * np.abs(load)
    torque = load + (friction + 21.0 * motor + 15.6 * generator) * np.sign(dq) + 42.0 * dq + 9.9
    rng = np.random.default_rng(20261122)
    noise = np.convolve(rng.normal(0, 5.5, len(q)), np.ones(4) / 4, "same")
    measured = torque + noise

    rigid = {
        "ZZ1R": ddq,
        "MX1": GRAVITY * np.cos(q),
        "MY1": GRAVITY * np.sin(q),
        "payload ratio": arm,
        "offset": np.ones_like(q),
    }
    usual = rigid | {"FV": dq, "FC": np.sign(dq)}
    names = ["viscous", "coulomb", "offset"]
    steps = {"usual": usual}
    steps["with load"] = usual | {
        "alpha": np.abs(load) * np.sign(dq),
        "c_g - c_m": generator * np.sign(dq),
    }
    steps["with stribeck"] = steps["with load"] | {
        "gamma": expo * np.abs(load) * np.sign(dq),
        "d": expo * np.sign(dq),
    }
    added = {
        "usual": [],
        "with load": ["load-friction-asymmetric"],
        "with stribeck": ["load-friction-asymmetric", "load-stribeck"],
    }
    return {
        key: SampleIdentification(
            tuple(EffectOnJoint(effect=effect, joint=JOINT) for effect in names + added[key]),
            columns,
            motion,
            measured,
        )
        for key, columns in steps.items()
    }


def make_diagnosis(models: dict[str, SampleIdentification]) -> DiagnosisDocument:
    """The diagnosis of the usual model."""
    before, after = models["usual"].relative_error, models["with load"].relative_error
    shares = {
        "load-friction-asymmetric": (1.0, 1e-30),
        "load-friction": (0.72, 1e-19),
        "stribeck": (0.41, 3e-8),
        "viscous-asymmetric": (0.11, 0.04),
        "friction-warmup": (0.02, 0.6),
    }
    candidates = [
        _candidate(effect, rank, before, before - share * (before - after), p_value)
        for rank, (effect, (share, p_value)) in enumerate(shares.items(), start=1)
    ]
    candidates[0] = candidates[0].changed(indistinguishable_from=("load-friction",))
    where = (
        _where("dq", -0.1, 0.1, 0.58),
        _where("load", 150.0, 240.0, 0.44),
        _where("q", -0.4, 0.3, 0.31),
    )
    return _diagnosis("usual", before, "missing", ("load-friction-asymmetric",), candidates, where)


@pytest.fixture(scope="session")
def models() -> dict[str, SampleIdentification]:
    return make_models()


def write_stored_experiment(folder: Path) -> None:
    """An experiment with three models on disk, in the form in which the service keeps it: nothing is fitted again."""
    models, motion = make_models(), _motion()
    rows = len(motion["time"]) // len(PAYLOADS)
    declared = {
        "format": 1,
        "name": "rx130l-joint3",
        "robot": {
            "gravity": [0.0, -GRAVITY, 0.0],
            "joints": [{"name": JOINT, "type": "revolute", "drive_gain": 35.15}],
        },
        "payloads": [
            {"name": name, "mass": mass, "com": [ARM, 0.0, 0.0]} for name, mass in PAYLOADS.values()
        ],
        "sessions": [{"file": file, "payload": payload} for file, (payload, _) in PAYLOADS.items()],
    }
    folder.mkdir(parents=True)
    (folder / "experiment.yaml").write_text(yaml.safe_dump(declared))
    for index, file in enumerate(PAYLOADS):
        chosen = slice(index * rows, (index + 1) * rows)
        columns = (motion["time"], motion["position"], models["usual"].measured / 35.15)
        table = np.column_stack([column[chosen] for column in columns])
        np.savetxt(folder / file, table, delimiter=",", header="t,q1,v1", comments="", fmt="%.8g")
    story = ModelStory(folder)
    fingerprint = data_fingerprint(folder)
    added: list[str] = []
    for number, (key, model) in enumerate(models.items(), start=1):
        fit_folder = story.new_fit_folder(f"m{number}", "f1")
        fit_folder.mkdir(parents=True)
        document = model.document()
        (fit_folder / IDENTIFICATION_FILE).write_text(document.json_text())
        for session, file in enumerate(PAYLOADS):
            write_prediction(fit_folder, session, 0, model.prediction(file, JOINT))
        change = None if key == "usual" else str(model.effects[-1])
        added = [*added, change] if change else added
        story.add_version(
            model="usual",
            add=added,
            cause="effect added" if change else "fit",
            change=change,
            user="ada",
            fit=Fit(
                id="f1",
                data=fingerprint,
                sessions=3,
                created=now_text(),
                relative_error=document.relative_error,
                relative_error_validation=document.relative_error_validation,
            ),
        )
    story.store_diagnosis("m1", make_diagnosis(models))
    story.store_diagnosis("m2", make_second_diagnosis(models))
    story.store_diagnosis("m3", make_last_diagnosis(models))
    story.undo()


def _candidate(effect: str, rank: int, before: float, after: float, p_value: float) -> Candidate:
    return Candidate(
        effect=effect,
        rank=rank,
        relative_error_before=before,
        relative_error_after=after,
        heldout_error_before=before * 1.05,
        heldout_error_after=after * 1.06,
        p_value=p_value,
        justified=p_value < 1e-3,
        indistinguishable_from=(),
        caution=None,
        explanation=CATALOGUE_WORDS.get(effect, "Friction depends on load and speed together."),
        equation=effects()[effect].equation,
        variable=effects()[effect].variable,
        constants={},
    )


def _where(variable: str, low: float, high: float, share: float) -> Where:
    return Where(
        variable=variable,
        from_=low,
        to=high,
        share_of_error=share,
        share_of_samples=0.25 * share,
        excess=0.75 * share,
    )


def _diagnosis(
    model: str,
    error: float,
    verdict: Verdict,
    missing: Sequence[str],
    candidates: Sequence[Candidate],
    where: Sequence[Where],
) -> DiagnosisDocument:
    joint = JointDiagnosis(
        joint=JOINT,
        verdict=verdict,
        missing=tuple(missing),
        candidates=tuple(candidates),
        evidence=tuple(each for each in candidates if each.effect in missing),
        where=tuple(where),
        noise_floor=0.021,
        structure=(),
        superfluous=(),
    )
    return DiagnosisDocument(
        experiment="rx130l-joint3",
        model=model,
        relative_error=error,
        relative_error_with_missing=candidates[0].relative_error_after if missing else error,
        noise_floor=0.021,
        joints=(joint,),
        not_applicable=(),
    )


def make_second_diagnosis(models: dict[str, SampleIdentification]) -> DiagnosisDocument:
    """The model with load friction still misses what happens at low speed."""
    before, after = (models[key].relative_error for key in ("with load", "with stribeck"))
    candidates = (
        _candidate("load-stribeck", 1, before, after, 1e-25).changed(indistinguishable_from=("stribeck",)),
        _candidate("stribeck", 2, before, before - 0.6 * (before - after), 1e-11),
        _candidate("viscous-power", 3, before, before - 0.2 * (before - after), 2e-4),
    )
    where = (_where("dq", -0.06, 0.06, 0.71),)
    return _diagnosis("usual", before, "missing", ("load-stribeck",), candidates, where)


def make_last_diagnosis(models: dict[str, SampleIdentification]) -> DiagnosisDocument:
    """Nothing is missing any more."""
    return _diagnosis("usual", models["with stribeck"].relative_error, "adequate", (), (), ())


@pytest.fixture(scope="session")
def stored_laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder of the service with one experiment of three sessions and three models."""
    folder = tmp_path_factory.mktemp("laboratory")
    write_stored_experiment(folder / "experiments" / "rx130l-joint3")
    return folder


@pytest.fixture(scope="session")
def browser_client(stored_laboratory: Path) -> Iterator[httpx.Client]:
    """The running service with that data folder, asked as a browser asks, by the local operator."""
    settings = ServiceSettings(data_folder=stored_laboratory)
    headers = {"Accept": "text/html"}
    with (
        served(create_application(settings)) as address,
        httpx.Client(base_url=address, headers=headers, timeout=60.0) as client,
    ):
        yield client


@pytest.fixture
def experiments(stored_laboratory: Path, tmp_path: Path) -> Experiments:
    """One experiment of which nobody has seen anything."""
    folder = shutil.copytree(stored_laboratory / "experiments" / "rx130l-joint3", tmp_path / "experiment")
    return SimpleNamespace(
        folder=lambda _: folder, declared=lambda _: read_experiment_file(folder / "experiment.yaml")
    )


@pytest.fixture(scope="module")
def laboratory(stored_laboratory: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """A service of one module's tests alone, with that experiment; what they change they change back."""
    folder, clock = tmp_path_factory.mktemp("of-one-module"), Clock()
    shutil.copytree(stored_laboratory / "experiments", folder / "experiments")
    application = create_application(ServiceSettings(data_folder=folder, clock=clock))
    with TestClient(application, base_url=ADDRESS) as client:
        yield RunningService(application, application.state.service, clock, client)
