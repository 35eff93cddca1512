"""`identify`: a model fitted to all sessions so far, its parameters with deviations, its errors."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.effects.catalogue import effects
from identify.effects.effect import Effect
from identify.effects.load_velocity import LoadVelocity, linear_names
from identify.effects.model import USUAL, Model, Term, parse_addition, parse_model
from identify.estimation.essential import RULE, essential_parameters
from identify.estimation.estimators import checked_estimator, with_estimator
from identify.estimation.fitting import FittedModel, Progress, fit_model
from identify.estimation.least_squares import spread
from identify.estimation.observation import Observation
from identify.estimation.prediction import Prediction, predict
from identify.estimation.record import Record
from identify.estimation.small_algebra import single_threaded
from identify.recording import Experiment, InputError, SessionEntry

Array = NDArray[np.float64]

LARGEST_CONDITION = 1e4
"""Condition number above which the linear form (30) is not identifiable on the record and the structured
one stands for it: its many products then fit noise, and its error on other sessions explodes."""


@dataclass(frozen=True)
class Parameter:
    """An estimated parameter.

    std, std_robust : standard deviations of eq. (13)-(15), and ones that hold for coloured residuals; None
    where
                      they cannot be given
    """

    name: str
    joint: str
    value: float
    std: float | None
    std_robust: float | None
    unit: str
    grouping: str | None

    @property
    def relative_std_percent(self) -> float | None:
        """eq. (16)"""
        return None if self.std is None or self.value == 0 else 100 * self.std / abs(self.value)

    def to_json(self) -> dict[str, Any]:
        """The contract's form, section 3."""
        return {
            "name": self.name,
            "joint": self.joint,
            "value": self.value,
            "std": self.std,
            "std_robust": self.std_robust,
            "relative_std_percent": self.relative_std_percent,
            "unit": self.unit,
            "grouping": self.grouping,
        }


@dataclass
class Identification:
    """The result of `identify`.

    fitted     : the fit that the errors and parameters are of
    structured : for `load-velocity`, the fit with one value for each physical parameter; the same fit
    otherwise
    form       : "linear" (eq. 30 with its products) or "structured"
    """

    experiment: Experiment
    model: str
    effects: tuple[Term, ...]
    fitted: FittedModel
    structured: FittedModel
    form: str = "structured"
    remarks: tuple[str, ...] = field(default=())

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of `fitted`."""
        return parameters_of(self.fitted)

    @cached_property
    def validation(self) -> Observation | None:
        """The same columns on the validation sessions."""
        entries = self.fitted.record.entries("validation")
        return self.fitted.observe(entries) if entries else None

    @cached_property
    def predictions(self) -> dict[tuple[str, str], Prediction]:
        """Predictions by session file and joint."""
        found = {}
        for entry in self.experiment.sessions:
            for prediction in predict(self.fitted, entry):
                found[entry.file, prediction.joint] = prediction
        return found

    def prediction(self, file: str, joint: str) -> Prediction:
        """What the model predicts for a joint in a session.

        :raises InputError: there is no such session or joint.
        """
        if (file, joint) not in self.predictions:
            sessions = ", ".join(entry.file for entry in self.experiment.sessions)
            joints = ", ".join(self.fitted.record.joint_names)
            raise InputError(
                f"session '{file}', joint '{joint}': sessions are {sessions}; joints are {joints}"
            )
        return self.predictions[file, joint]

    @property
    def relative_error(self) -> float:
        """‖Y − Wχ‖ / ‖Y‖ over all joints and identification sessions."""
        return self.fitted.fit.relative_error

    @property
    def relative_error_validation(self) -> float | None:
        """The same on the validation sessions."""
        if self.validation is None:
            return None
        errors = block_errors(self.validation, self.fitted.fit.chi)
        return _ratio(errors[:, :, 0].sum(), errors[:, :, 1].sum())

    def to_json(self) -> dict[str, Any]:
        """The contract's `identify --json`, section 3."""
        from identify.validation.noise_floor import noise_floors

        record = self.fitted.record
        training = block_errors(self.fitted.observation, self.fitted.fit.chi)
        checked = None if self.validation is None else block_errors(self.validation, self.fitted.fit.chi)
        floors = noise_floors(record)
        document: dict[str, Any] = {
            "experiment": self.experiment.name,
            "model": self.model,
            "effects": [
                {"effect": term.effect.name, "joint": record.joint_names[term.joint]} for term in self.effects
            ],
            "relative_error": number(self.relative_error),
            "relative_error_validation": number(self.relative_error_validation),
            "joints": [
                {
                    "joint": name,
                    "relative_error": _ratio(*training[:, joint].sum(0)),
                    "relative_error_validation": None
                    if checked is None
                    else _ratio(*checked[:, joint].sum(0)),
                    "noise_floor": number(floors[joint]),
                }
                for joint, name in enumerate(record.joint_names)
            ],
            "sessions": self._sessions(training, checked),
            "parameters": [parameter.to_json() for parameter in self.parameters],
            "condition_number": number(self.fitted.fit.condition_number),
            "samples": int(self.fitted.fit.rows.sum()),
            "form": self.form,
            "estimator": self.fitted.estimator,
            "eliminated": self._eliminated(),
            "constants": [
                {"effect": t.effect.name, "joint": record.joint_names[t.joint], **dict(t.constants)}
                for t in self.structured.model.terms
                if t.constants
            ],
            "signals": record.settings.report(),
            "not_identifiable": self._dropped(),
            "remarks": [*self.remarks, *self._estimate_remarks(), *self._session_remarks()],
        }
        if self.structured is not self.fitted:
            document["structured"] = {
                "relative_error": number(self.structured.fit.relative_error),
                "parameters": [parameter.to_json() for parameter in parameters_of(self.structured)],
            }
        return document

    def _sessions(self, training: Array, checked: Array | None) -> list[dict[str, Any]]:
        found = {}
        for observation, errors in ((self.fitted.observation, training), (self.validation, checked)):
            if observation is not None and errors is not None:
                for index, entry in enumerate(observation.entries):
                    own = errors[observation.blocks_of(index)].sum(axis=(0, 1))
                    found[entry.file] = {
                        "file": entry.file,
                        "payload": entry.payload.name,
                        "role": entry.role,
                        "relative_error": _ratio(*own),
                    }
        return [found[entry.file] for entry in self.experiment.sessions if entry.file in found]

    def _dropped(self) -> list[str]:
        described = column_names(self.fitted)
        return [described[column][0] for column in self.fitted.fit.dropped]

    def _eliminated(self) -> list[dict[str, Any]]:
        described = column_names(self.fitted)
        return [own.to_json(*described[own.column][:2]) for own in self.fitted.eliminated]

    def _estimate_remarks(self) -> list[str]:
        found = list(self.fitted.estimate.remarks) if self.fitted.estimate else []
        if self.fitted.eliminated:
            found.append(f"{len(self.fitted.eliminated)} parameters {RULE}")
        return found

    def _session_remarks(self) -> list[str]:
        record = self.fitted.record
        return [
            f"{entry.file}: {remark}"
            for entry in self.experiment.sessions
            for remark in record.facts(entry).remarks
        ]


@single_threaded
def identify(
    experiment: Experiment,
    model: str = "usual",
    add: Sequence[str] = (),
    progress: Progress | None = None,
    estimator: str | None = None,
    essential: bool = False,
) -> Identification:
    """Fit a model to all identification sessions at once and check it on the validation sessions.

    model     : `rigid`, `usual` (eq. 8), `load-velocity` (eq. 30), or `rigid+effect,effect…`
    add       : further effects, `EFFECT` or `EFFECT@JOINT`
    estimator : `ordinary`, `weighted`, `robust` or `instrumental`; weighted for several joints if not said
    essential : eliminate the parameters that the data do not show, one by one (section IV.D)
    :raises InputError: the experiment, the model, an effect or the estimator is wrong.
    """
    estimator = checked_estimator(estimator, experiment.n)
    record = open_record(experiment)
    wanted = requested_model(record, model, add)

    def estimated(fitted: FittedModel) -> FittedModel:
        reduced = essential_parameters(fitted, ratio_columns(fitted)) if essential else fitted
        return with_estimator(reduced, estimator)

    first = fit_model(record, wanted, progress=progress)
    fitted = estimated(first)
    if model != "load-velocity":
        return Identification(experiment, model, fitted.model.terms, fitted, fitted)
    linear = estimated(fit_linear(record, first, add))
    if linear.fit.condition_number <= LARGEST_CONDITION and not len(linear.fit.dropped):
        return Identification(experiment, model, fitted.model.terms, linear, fitted, "linear")
    remark = (
        f"the linear form (30) is not identifiable on this record (condition number "
        f"{linear.fit.condition_number:.2g}); the structured form stands for it"
    )
    return Identification(experiment, model, fitted.model.terms, fitted, fitted, "structured", (remark,))


def ratio_columns(fitted: FittedModel) -> list[int]:
    """Columns of payload and gain ratios, whose parameter is how far the ratio is from one."""
    return [
        int(column)
        for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True)
        if slot.term.effect.name in ("payload-mass", "drive-gain")
        for column in columns
    ]


def open_record(experiment: Experiment) -> Record:
    """The record of an experiment that has something to identify from.

    :raises InputError: there is no identification session, or a joint never moves.
    """
    record = Record.of(experiment)
    if not record.entries():
        raise InputError(f"{experiment.path}: sessions: at least one needs role identification")
    return record


def known_effects(experiment: Experiment) -> dict[str, Effect]:
    """The catalogue and the user's own effects that the experiment names.

    :raises InputError: a file of an own effect is wrong, or its name is taken.
    """
    known = dict(effects())
    if experiment.effects:
        from identify.effects.expression import load_own_effect

        for path in experiment.effects:
            own = load_own_effect(path)
            if own.name in known:
                raise InputError(f"{path}: name: an effect named '{own.name}' is already in the catalogue")
            known[own.name] = own
    return known


def requested_model(record: Record, model: str, add: Sequence[str] = ()) -> Model:
    """The model that `--model` and `--add` name.

    :raises InputError: a name is wrong, or the record cannot show an effect that was asked for.
    """
    known, gain = known_effects(record.experiment), record.experiment.drive_gain
    wanted = parse_model(model, record.joint_names, known, gain)
    for text in add:
        terms = parse_addition(text, record.joint_names, known, gain)
        able = [t for t in terms if not t.effect.obstacle(record.summaries[t.joint])]
        if not able:
            name, _, joint = text.partition("@")
            summary = record.summaries[record.joint_names.index(joint) if joint else 0]
            reason = known[name].obstacle(summary) or "no joint of this robot has it"
            raise InputError(f"--add {text}: this record cannot show it: {reason}")
        wanted = wanted.with_terms(able)
    return wanted


def fit_linear(record: Record, structured: FittedModel, add: Sequence[str]) -> FittedModel:
    """The linear form (30), with the power sign of the structured fit's load."""
    known, gain = known_effects(record.experiment), record.experiment.drive_gain
    terms = [
        term
        for joint in range(record.joints)
        for term in (Term(LoadVelocity(), joint), Term(known["viscous"], joint), Term(known["offset"], joint))
    ]
    split = {*USUAL, "load-friction-asymmetric", "stribeck", "load-stribeck"}
    more = [t for text in add for t in parse_addition(text, record.joint_names, known, gain)]
    model = Model("load-velocity", tuple(terms)).with_terms(t for t in more if t.effect.name not in split)
    return fit_model(record, model, load_from=structured.torque, inertial=False)


def block_errors(observation: Observation, chi: Array) -> Array:
    """(blocks, joints, 2): squared norms of residual and of measured torque."""
    found = np.zeros((len(observation.blocks), len(observation.joint_columns), 2))
    for block, factors in enumerate(observation.factors):
        for joint, factor in enumerate(factors):
            rows = spread(observation, joint, factor)
            residual = rows[:, -2] - rows[:, :-2] @ chi
            found[block, joint] = residual @ residual, rows[:, -1] @ rows[:, -1]
    return found


def column_names(fitted: FittedModel) -> list[tuple[str, str, str, str | None]]:
    """Name, joint, unit and grouping of every column."""
    record = fitted.record
    base = record.body.base
    found: list[tuple[str, str, str, str | None]] = [
        (name, joint, unit, grouping)
        for name, joint, unit, grouping in zip(
            base.names, base.joints, base.units, base.groupings, strict=True
        )
    ]
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        found += slot_names(record, slot.term, slot.values, len(columns))
    return found


def slot_names(
    record: Record, term: Term, constants: dict[str, float], count: int
) -> list[tuple[str, str, str, str | None]]:
    """Name, joint, unit of an effect's columns."""
    summary = record.summaries[term.joint]
    if isinstance(term.effect, LoadVelocity):
        acts = record.body.base.acts[term.joint]
        names = [n for n, on in zip(record.body.base.names, acts, strict=True) if on]
        units = [u for u, on in zip(record.body.base.units, acts, strict=True) if on]
        listed = linear_names(names, units)
        suffix = "" if record.joints == 1 else f"@{summary.name}"
        return [(name + suffix, summary.name, _unit(unit, summary.revolute), None) for name, unit in listed]
    listed = list(term.effect.parameters_of(summary, constants))
    if len(listed) != count:
        listed = [(f"{listed[0][0]}[{index + 1}]", listed[0][1]) for index in range(count)]
    across = term.effect.rows == "robot"
    return [
        (name if across else f"{name}{term.joint + 1}", summary.name, _unit(unit, summary.revolute), None)
        for name, unit in listed
    ]


def _unit(unit: str, revolute: bool) -> str:
    return unit if revolute else unit.replace("N m", "N").replace("rad", "m")


def parameters_of(fitted: FittedModel) -> tuple[Parameter, ...]:
    """The fitted parameters with their deviations; the payload ratio as M_ae/M_aw, 1 where the payload is as
    declared."""
    std, robust = fitted.deviations
    named = column_names(fitted)
    shifted = np.zeros(len(named))
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        shifted[columns] = slot.term.effect.reported_offset(slot.values)
        if isinstance(slot.term.effect, LoadVelocity):
            names = [named[column][0].partition("@")[0] for column in columns]
            shifted[columns] = [1.0 if name in ("a_m", "a_g") else 0.0 for name in names]
    return tuple(
        Parameter(
            named[column][0],
            named[column][1],
            float(fitted.fit.chi[column] + shifted[column]),
            number(float(std[column])),
            number(float(robust[column])),
            named[column][2],
            named[column][3],
        )
        for column in fitted.fit.fitted
    )


def session_entry(experiment: Experiment, file: str) -> SessionEntry:
    """The session of that file name.

    :raises InputError: there is none.
    """
    for entry in experiment.sessions:
        if entry.file == file:
            return entry
    raise InputError(
        f"session '{file}': sessions are {', '.join(entry.file for entry in experiment.sessions)}"
    )


def _ratio(residual: float, measured: float) -> float | None:
    return None if measured <= 0 else float(np.sqrt(residual / measured))


def number(value: float | None) -> float | None:
    """A figure for JSON: None where it cannot be given."""
    return None if value is None or not np.isfinite(value) else float(value)
