"""The exported document, from its file alone, is the identified model."""

from __future__ import annotations

import pytest

from identify.export.document_torque import document_torque
from identify.export.exported_model import exported_model
from identify.export.formula_torque import module_of, module_torque
from identify.export.model_document import model_document
from identify.recording import InputError
from tests.identify.export.identified_torque import of_the_model, without_payload_ratio


def test_the_document_is_the_model(result, motion, tmp_path):
    model = exported_model(result)
    (tmp_path / "arm.json").write_text(model_document(model).json_text())
    torque_of = document_torque(tmp_path / "arm.json")
    bare = without_payload_ratio(result, motion)
    assert torque_of(bare) == pytest.approx(of_the_model(result, bare), rel=1e-9, abs=1e-9)
    assert torque_of(motion) == pytest.approx(
        module_torque(module_of(model), model)(motion), rel=1e-9, abs=1e-9
    )


def test_a_file_that_is_no_document_is_refused_with_its_name(tmp_path):
    (tmp_path / "arm.json").write_text('{"format": 2, "experiment": "e"}')
    with pytest.raises(InputError, match=r"arm\.json"):
        document_torque(tmp_path / "arm.json")
