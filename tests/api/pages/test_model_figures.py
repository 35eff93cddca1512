"""Tables and figures of the error: of the sessions of the fit, on the scales of the first model."""

import json

import numpy as np
import pytest

from api.pages.error_figures import JointUnits
from api.pages.model_figures import counted_errors, error_views_of, figures_of
from api.pages.stored_models import StoredExperiment

JOINT = "j3"


def test_figures_are_of_the_sessions_of_the_fit_as_the_tables_are(experiments) -> None:
    (document,) = experiments.folder("").glob("models/m1/*/identification.json")
    # The last session only checks the model.
    roles = json.loads(document.read_text())
    roles["sessions"][-1]["role"] = "validation"
    document.write_text(json.dumps(roles))
    stored = StoredExperiment(experiments, "experiment")
    shown = stored.model("m1")
    files = stored.fitted_files(shown)
    units = JointUnits.of("revolute")
    of_fit, all_files = (figures_of(stored, [shown], JOINT, each, units) for each in (files[:-1], files))
    assert all_files == of_fit
    tables = counted_errors(stored, [shown], JOINT, files).tables
    assert [row.words for row in tables["payload"]] == [stored.payload_of[file] for file in files[:-1]]
    assert [row.session for row in tables["session"]] == [*files[:-1], None]


def test_errors_are_those_of_the_samples_that_were_fitted(experiments, models) -> None:
    stored = StoredExperiment(experiments, "experiment")
    files = list(stored.payload_of)
    both = [stored.model("m2"), stored.model("m1")]
    counted = counted_errors(stored, both, JOINT, files)
    fitted = models["with load"]
    error = fitted.measured - fitted.fitted
    assert counted.samples == len(error)
    assert counted.rms == pytest.approx(np.sqrt(np.mean(error**2)))
    assert counted.rms_measured == pytest.approx(np.sqrt(np.mean(fitted.measured**2)))
    assert counted.relative_error == pytest.approx(fitted.relative_error)
    one = counted_errors(stored, both[:1], JOINT, files[1:2])
    assert one.samples == len(error) // len(files)
    assert one.relative_error == pytest.approx(fitted._relative(fitted._rows(files[1])))


def test_a_model_is_drawn_on_the_scales_of_the_first_one(experiments, monkeypatch) -> None:
    stored = StoredExperiment(experiments, "experiment")
    files = list(stored.payload_of)
    first, second = (error_views_of(stored, stored.model(each), JOINT, files) for each in ("m1", "m2"))
    assert first.bands.keys() == second.bands.keys()
    for name, band in first.bands.items():
        np.testing.assert_allclose(band.centre, second.bands[name].centre, rtol=1e-6, atol=1e-6)
    assert second.ends != first.ends
    # what was kept of both is drawn again without a sample
    monkeypatch.setattr(stored, "figure_samples", None)
    assert error_views_of(stored, stored.model("m1"), JOINT, files).ends == first.ends
    assert error_views_of(stored, stored.model("m2"), JOINT, files).ends == second.ends
    with pytest.raises(TypeError):  # of other files than those kept
        error_views_of(stored, stored.model("m2"), JOINT, files[:1])
