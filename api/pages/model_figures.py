"""The error of models as tables and figures, of numbers that are kept beside each fit."""

from dataclasses import dataclass

from api.pages.error_figures import ErrorFigures, JointUnits, draw_error_figures
from api.pages.error_tables import (
    ErrorRow,
    ErrorSums,
    by_payload,
    by_power_sign,
    by_session,
    by_speed,
    error_sums,
    files_in_fit,
    together,
)
from api.pages.error_views import ErrorViews, FirstViews, error_views, first_views
from api.pages.kept_numbers import KeptNumbers
from api.pages.stored_models import ShownModel, StoredExperiment

_sums: KeptNumbers[ErrorSums] = KeptNumbers("sums", ErrorSums)
_first: KeptNumbers[FirstViews] = KeptNumbers("first", FirstViews)
_views: KeptNumbers[ErrorViews] = KeptNumbers("error", ErrorViews)


@dataclass(frozen=True)
class CountedErrors:
    """Tables of errors of one or two models, and error, sizes of torque and error of the first over `samples` samples, in
    the unit of the load; None where nothing moved. All are of the same samples: those of the fit, or of one session."""

    samples: int
    relative_error: float | None
    rms: float | None
    rms_measured: float | None
    tables: dict[str, list[ErrorRow]]


def counted_errors(
    stored: StoredExperiment, models: list[ShownModel], joint: str, files: list[str]
) -> CountedErrors:
    """The tables of errors and the sizes of torque and error, of every sample in the fit.

    Sessions that the fit was not made of (validation) only stand in the table by session, unless nothing else is shown.
    """
    fitted = stored.files_of_fit(models[0])
    used = files_in_fit(files, fitted)
    sums = [_sums_of(stored, model, joint, files, used) for model in models]
    shown = together(sums[0].sessions, used)
    return CountedErrors(
        samples=int(shown.samples),
        relative_error=shown.relative_error,
        rms=shown.rms(shown.error),
        rms_measured=shown.rms(shown.measured),
        tables={
            "speed": by_speed(sums, used),
            "power": by_power_sign(sums),
            "payload": by_payload([each.sessions for each in sums], stored.payload_of, used),
            "session": by_session(sums, fitted),
        },
    )


def figures_of(
    stored: StoredExperiment, models: list[ShownModel], joint: str, files: list[str], units: JointUnits
) -> ErrorFigures:
    """Draw the error of one or two models over `files`, on the scales of the first model; as in the tables only of those in
    the fit, unless nothing else is shown."""
    used = files_in_fit(files, stored.files_of_fit(models[0]))
    _, of_first, _ = _of_first(stored, joint, used)
    shown, *others = (error_views_of(stored, model, joint, used) for model in models)
    other = others[0] if others else None
    sums = [_sums_of(stored, model, joint, files, used).sessions for model in models]
    payloads = by_payload(sums, stored.payload_of, used)
    return draw_error_figures(shown, of_first.scales, units, payloads, other, other or of_first.views)


def error_views_of(stored: StoredExperiment, model: ShownModel, joint: str, files: list[str]) -> ErrorViews:
    """What a model's figures over `files` show, on the scales of the first model."""
    first, of_first, files_of_first = _of_first(stored, joint, files)
    if model.folder == first.folder and files == files_of_first:
        return of_first.views
    return _views.of(
        model.folder,
        [joint, files, of_first.scales.key],
        lambda: error_views(stored.figure_samples(model, joint, files).in_fit, of_first.scales),
    )


def _of_first(
    stored: StoredExperiment, joint: str, files: list[str]
) -> tuple[ShownModel, FirstViews, list[str]]:
    """The first model, what its figures show, and over which of the files: those that it was fitted with."""
    first = stored.model(stored.story.versions[0].id)
    known = stored.fitted_files(first)
    of_first = [file for file in files if file in known] or files
    views = _first.of(
        first.folder,
        [joint, of_first],
        lambda: first_views(stored.figure_samples(first, joint, of_first).in_fit),
    )
    return first, views, of_first


def _sums_of(
    stored: StoredExperiment, model: ShownModel, joint: str, files: list[str], used: list[str]
) -> ErrorSums:
    """Of a model over `files`, of which `used` are in the fit."""
    return _sums.of(
        model.folder,
        [joint, files, used],
        lambda: error_sums(stored.stored_samples(model, joint, files), used),
    )
