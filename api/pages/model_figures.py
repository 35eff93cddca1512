"""The error of models as tables and figures, kept as long as they are looked at: a stored fit never changes."""

from dataclasses import dataclass

import numpy as np

from api.pages.error_figures import ErrorFigures, JointUnits, error_figures, part_of_fit, tables
from api.pages.error_tables import ErrorRow
from api.pages.joint_samples import relative_error
from api.pages.lru_cache import LruCache
from api.pages.stored_models import ShownModel, StoredExperiment

FIGURE_SAMPLES = 150_000
"""More samples than this are thinned for bands and maps; figures and tables of errors use all."""


_drawn: LruCache[ErrorFigures] = LruCache(64)


@dataclass(frozen=True)
class CountedErrors:
    """Tables of errors of one or two models, and error, sizes of torque and error of the first over `samples` samples, in
    the unit of the load; None where nothing moved. All are of the same samples: those of the fit, or of one session."""

    samples: int
    relative_error: float | None
    rms: float | None
    rms_measured: float | None
    tables: dict[str, list[ErrorRow]]


_counted: LruCache[CountedErrors] = LruCache(64)


def counted_errors(
    stored: StoredExperiment, models: list[ShownModel], joint: str, files: list[str]
) -> CountedErrors:
    """The tables of errors and the sizes of torque and error, of every sample in the fit; kept while they are seen."""

    def count() -> CountedErrors:
        samples = [stored.samples(model, joint, files).in_fit for model in models]
        fitted = stored.files_of_fit(models[0])
        of_shown = part_of_fit(samples, fitted)[0]
        return CountedErrors(
            samples=len(of_shown.time),
            relative_error=relative_error(of_shown.measured, of_shown.error),
            rms=float(np.sqrt(np.mean(of_shown.error**2))) if len(of_shown.time) else None,
            rms_measured=float(np.sqrt(np.mean(of_shown.measured**2))) if len(of_shown.time) else None,
            tables=tables(samples, stored.payload_of, fitted),
        )

    return _counted.get((*(model.folder for model in models), joint, tuple(files)), count)


def figures_of(
    stored: StoredExperiment,
    models: list[ShownModel],
    first: ShownModel,
    joint: str,
    files: list[str],
    units: JointUnits,
) -> ErrorFigures:
    """Draw the error of one or two models over `files`, on the scales of the first model."""

    def draw() -> ErrorFigures:
        shown, *others = (
            stored.samples(model, joint, files).thinned(FIGURE_SAMPLES).in_fit for model in models
        )
        known = stored.fitted_files(first)
        first_files = [file for file in files if file in known] or files
        start = stored.samples(first, joint, first_files).thinned(FIGURE_SAMPLES).in_fit
        return error_figures(shown, start, stored.payload_of, units, others[0] if others else None)

    return _drawn.get((*(model.folder for model in models), first.folder, joint, tuple(files)), draw)
