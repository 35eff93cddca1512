"""What a report says of one joint: verdict, staircase, torque of every session, map, bands and tables."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from markupsafe import Markup

from api.pages.catalogue_words import effect_titles
from api.pages.error_figures import ErrorFigures, JointUnits
from api.pages.error_tables import ErrorRow
from api.pages.evidence_view import SelectedEvidence, added_evidence, joint_diagnosis
from api.pages.figures.torque_time import POINTS, TorqueRows, draw_torque_rows
from api.pages.model_figures import counted_errors, figures_of
from api.pages.model_steps import step_chart
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.torque_curves import TorqueCurves
from api.pages.verdict_words import unseen_error, verdict_of
from api.service.torque_outline import reduced
from identify.results.identification import JointError


@dataclass(frozen=True)
class SessionTorque:
    """One session, drawn."""

    file: str
    payload: str
    figure: Markup


class JointSection:
    """Everything is drawn when the template comes to it, so that whoever reads the report waits for its beginning alone.

    Raises the problem 404 when it is made, if a session has no samples.
    """

    def __init__(self, stored: StoredExperiment, shown: ShownModel, joint: str) -> None:
        self._stored, self._shown, self.name = stored, shown, joint
        self.units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
        self._files = stored.fitted_files(shown)
        stored.require_samples(shown, joint, self._files)
        first = stored.model(stored.story.versions[0].id)
        self._models, self.models = [shown], ["this model"]
        if first.version.id != shown.version.id and stored.fitted_files(first) == self._files:
            self._models, self.models = [shown, first], ["this model", "first model"]
        self.part: JointError = shown.joint(joint)
        diagnosis = joint_diagnosis(stored, shown, joint)
        self.unseen = unseen_error(diagnosis)
        self.verdict = verdict_of(diagnosis, self.part.noise_floor, effect_titles())

    @property
    def staircase(self) -> Markup:
        """The error over the versions."""
        return step_chart(self._stored, self.name, self.part.noise_floor)

    @property
    def added(self) -> list[SelectedEvidence]:
        """The evidence of every effect that was added to the joint."""
        return added_evidence(self._stored, self._shown, self.name)

    @property
    def sessions(self) -> Iterator[SessionTorque]:
        """Torque over time of each whole session; the error only where the joint moves."""
        label = "torque" if self.units.load == "N m" else "force"
        for file in self._files:
            curves = TorqueCurves.of(self._stored, self._shown, self.name, [file])
            part = curves.parts[file]
            drawn, _ = reduced(part, curves.outlines[file], slice(0, part.count), POINTS)
            figure = draw_torque_rows(TorqueRows(drawn.time, **drawn.curves), label, self.units.load)
            yield SessionTorque(file, self._stored.payload_of[file], figure)

    @cached_property
    def figures(self) -> ErrorFigures:
        """Of this model, and of the first one beside it."""
        return figures_of(self._stored, self._models, self.name, self._files, self.units)

    @cached_property
    def tables(self) -> dict[str, list[ErrorRow]]:
        """Of the relative errors."""
        return counted_errors(self._stored, self._models, self.name, self._files).tables
