"""A model identified on all sessions so far: its parameters with deviations, its errors, its predictions."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

from identify.effects.model import Term
from identify.estimation.block_errors import block_errors, ratio
from identify.estimation.doubts import Doubt, cut_commands, doubts, in_words, parameter_doubts
from identify.estimation.essential import RULE
from identify.estimation.fitted_model import FittedModel
from identify.estimation.observation import Observation
from identify.estimation.parameters import Parameter, number, parameters_of
from identify.estimation.prediction import Prediction, predict_sessions
from identify.estimation.structured import StructuredFit
from identify.recording import Experiment, InputError, SessionEntry
from identify.results.identification import Role


@dataclass
class Identified:
    """What was identified, as numbers; `identify.identification.Identification` adds its document.

    fitted     : the fit that the errors and parameters are of
    structured : for `load-velocity`, the estimate with one value for each physical parameter
    form       : of `load-velocity`: "linear" (eq. 30 with its products) or "structured", where the linear
                 form is not identifiable and the structured one stands for it; "linear" for all other models
    unknown_payloads : names of payloads that were estimated, whatever was declared of them
    """

    experiment: Experiment
    model: str
    effects: tuple[Term, ...]
    fitted: FittedModel
    structured: StructuredFit | None = None
    form: Literal["linear", "structured"] = "linear"
    remarks: tuple[str, ...] = field(default=())
    unknown_payloads: tuple[str, ...] = ()

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of `fitted`."""
        if self.form == "structured":
            return self.structured_parameters
        doubted = {column: doubt.words for column, doubt in parameter_doubts(self.fitted).items()}
        columns = self.fitted.fit.fitted.tolist()
        return tuple(
            replace(parameter, doubt=doubted.get(column))
            for column, parameter in zip(columns, parameters_of(self.fitted), strict=True)
        )

    @property
    def doubts_in_words(self) -> list[str]:
        """A sentence for all parameters of which the same is doubtful: of the structured estimate where there is one."""
        doubted = parameter_doubts(self.fitted) if self.structured is None else self._held
        return in_words(doubted.values())

    @cached_property
    def _held(self) -> dict[str, Doubt]:
        """By name the parameters of the structured estimate that the motion does not tell."""
        form = self.structured
        if form is None:
            return {}
        listed = zip(form.names, form.values, strict=True)
        return {
            name: Doubt(
                name,
                "is not told by the motion: it is held at",
                "are not told by the motion: they are held at",
                f"{value:g}",
            )
            for (name, *_), value in listed
            if name in form.held
        }

    @cached_property
    def structured_parameters(self) -> tuple[Parameter, ...]:
        """One value for each physical parameter of `load-velocity`; empty for other models."""
        if self.structured is None:
            return ()
        form, held = self.structured, self._held
        listed = zip(form.names, form.values, form.std, form.std_robust, strict=True)
        return tuple(
            Parameter(
                name,
                joint,
                float(value),
                number(float(std)),
                number(float(robust)),
                unit,
                grouping,
                held[name].words if name in held else None,
            )
            for (name, joint, unit, grouping), value, std, robust in listed
        )

    @cached_property
    def validation(self) -> Observation | None:
        """The same columns on the validation sessions."""
        entries = self.fitted.record.entries("validation")
        return self.fitted.observe(entries) if entries else None

    @cached_property
    def left_out(self) -> Observation | None:
        """The same columns on identification sessions that the fit was asked to leave out."""
        used = {entry.file for entry in self.fitted.entries}
        entries = [entry for entry in self.fitted.record.entries() if entry.file not in used]
        return self.fitted.observe(entries) if entries else None

    @cached_property
    def predictions(self) -> dict[tuple[str, str], Prediction]:
        """Predictions by session file and joint."""
        by_session = predict_sessions(self.fitted, self.experiment.sessions)
        return {
            (prediction.file, prediction.joint): prediction for parts in by_session for prediction in parts
        }

    def prediction(self, file: str, joint: str) -> Prediction:
        """What the model predicts for a joint in a session.

        Raises InputError: there is no such session or joint.
        """
        if (file, joint) not in self.predictions:
            sessions = ", ".join(entry.file for entry in self.experiment.sessions)
            joints = ", ".join(self.fitted.record.joint_names)
            raise InputError(
                f"session '{file}', joint '{joint}': sessions are {sessions}; joints are {joints}"
            )
        return self.predictions[file, joint]

    def role_of(self, entry: SessionEntry) -> Role:
        """How a session was used: identification, validation, or left out."""
        if entry.role == "validation":
            return "validation"
        files = {used.file for used in self.fitted.entries}
        return "identification" if entry.file in files else "left out"

    @property
    def relative_error(self) -> float:
        """‖Y − Wχ‖ / ‖Y‖ over all joints and the sessions of the fit."""
        return self.fitted.fit.relative_error

    @property
    def relative_error_validation(self) -> float | None:
        """The same on the validation sessions."""
        return self._error_on(self.validation)

    @property
    def relative_error_left_out(self) -> float | None:
        """The same on identification sessions that were left out of the fit."""
        return self._error_on(self.left_out)

    def _error_on(self, observation: Observation | None) -> float | None:
        if observation is None:
            return None
        errors = block_errors(observation, self.fitted.fit.chi)
        return ratio(errors[:, :, 0].sum(), errors[:, :, 1].sum())

    @property
    def all_remarks(self) -> list[str]:
        """What the reader of the result must know: of the model, the estimate, and the sessions."""
        record, fitted = self.fitted.record, self.fitted
        remarks = doubts(self.fitted, self.relative_error, self.relative_error_validation)
        remarks += self.remarks
        if self.structured is not None:
            remarks += self.structured.remarks
        if fitted.estimate is not None:
            remarks += fitted.estimate.remarks
        if fitted.eliminated:
            remarks.append(f"{len(fitted.eliminated)} parameters {RULE}")
        remarks += cut_commands(record)
        for entry in self.experiment.sessions:
            remarks += [f"{entry.file}: {remark}" for remark in record.facts(entry).remarks]
        return remarks
