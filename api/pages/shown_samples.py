"""What an address of the model's page shows: joint, models and sessions; said once for all that draws samples of it."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from fastapi import Depends, Query, Request
from numpy.typing import NDArray

from api.pages.choices import ALL_SESSIONS, SessionChoice, VersionChoice, chosen_model, files_of_session
from api.pages.error_tables import files_in_fit
from api.pages.sample_columns import SampleColumns
from api.pages.sample_selection import ChosenSamples, SampleSelection
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access


@dataclass(frozen=True)
class ShownSamples:
    """Samples of one joint: of a model, of the one beside it (None: none), over some sessions; and which are chosen.

    counted : those of the sessions that tables and figures are of: in the fit, unless nothing else is shown
    """

    stored: StoredExperiment
    model: ShownModel
    beside: ShownModel | None
    joint: str
    files: list[str]
    counted: list[str]
    columns: SampleColumns
    selection: SampleSelection | None

    def chosen_of_file(self, file: str) -> NDArray[np.bool_]:
        """(samples,) which of all stored samples of a session are chosen; those at rest are no part of the fit, and never
        are. Raises the problems of `SampleColumns.of_file`."""
        moving = self.stored.stored_samples(self.model, self.joint, [file])[file].moves()
        if self.selection is None or self.selection.session not in (None, file):
            return np.zeros(len(moving), bool)
        return moving & self.selection.among(lambda name: self.columns.of_file(file, name), len(moving))

    def chosen_of_fit(self) -> NDArray[np.bool_]:
        """(samples,) which samples of the fit are chosen, of all sessions one after the other. Raises the problems of
        `SampleColumns.in_fit`."""
        samples = self.stored.samples(self.model, self.joint, self.counted).in_fit
        if self.selection is None:
            return np.zeros(len(samples.time), bool)
        chosen = self.selection.among(self.columns.in_fit, len(samples.time))
        if self.selection.session is not None:
            of_session = [place for place, file in enumerate(samples.files) if file == self.selection.session]
            chosen &= np.isin(samples.session, of_session)
        return chosen


def shown_samples(
    request: Request,
    _user: access.Viewer,
    experiment: str,
    joint: Annotated[str, Query(max_length=64)],
    version: Annotated[str, Query(max_length=12)],
    session: SessionChoice = ALL_SESSIONS,
    beside: VersionChoice = None,
    chosen: ChosenSamples = "",
) -> ShownSamples:
    """From the address. Raises the problems 404 (no such joint, model or session) and 422 (no such choice)."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    model, other = stored.model(version), chosen_model(stored, beside)
    joint = stored.joint_or_first(joint)
    files = files_of_session(stored, model, other, session)
    counted = files_in_fit(files, stored.files_of_fit(model))
    columns = SampleColumns(stored, model, joint, counted, service.samples)
    return ShownSamples(stored, model, other, joint, files, counted, columns, SampleSelection.parse(chosen))


Shown = Annotated[ShownSamples, Depends(shown_samples)]
