"""Documents of results: what any of them promises."""

import importlib
import json
import math
import pkgutil

import pytest
from pydantic import BaseModel, ValidationError

import identify.results
from identify.results.diagnosis import JointDiagnosis, Where
from identify.results.document import Document, Part
from identify.results.effect import CatalogueEffect, EffectOnJoint
from identify.results.identification import EffectConstants, JointError, SpeedError
from identify.results.improvement import ImprovementDocument, Step

for _module in pkgutil.iter_modules(identify.results.__path__):
    importlib.import_module(f"identify.results.{_module.name}")
WHOLE = (*Document.__subclasses__(), CatalogueEffect)
"""every document there is"""


def parts_of(kind: type[BaseModel]) -> dict[str, dict]:
    """Schemas of a document and of all its parts, by name."""
    schema = kind.model_json_schema()
    return schema.pop("$defs", {}) | {kind.__name__: schema}


@pytest.mark.parametrize("kind", WHOLE)
def test_every_field_says_what_it_is(kind):
    for name, schema in parts_of(kind).items():
        for field, entry in schema.get("properties", {}).items():
            assert entry.get("description"), f"{name}.{field} has no description"
        assert schema.get("description"), f"{name} has no description"


@pytest.mark.parametrize("kind", WHOLE)
def test_unknown_keys_are_refused_everywhere(kind):
    for name, schema in parts_of(kind).items():
        extra = schema.get("additionalProperties")
        expected = {"type": "number"} if name == "EffectConstants" else False
        assert extra == expected, name


def test_a_document_cannot_be_changed():
    error = JointError(joint="j1", relative_error=0.1, relative_error_validation=None, noise_floor=None)
    with pytest.raises(ValidationError, match="frozen"):
        error.relative_error = 0.2


def test_a_figure_that_is_not_finite_is_null():
    error = JointError(
        joint="j1", relative_error=math.inf, relative_error_validation=math.nan, noise_floor=None
    )
    assert error.to_json() == {
        "joint": "j1",
        "relative_error": None,
        "relative_error_validation": None,
        "noise_floor": None,
        "noise_floor_interval": None,
    }


def test_ranges_are_written_with_the_contracts_keys_and_read_from_them():
    where = Where(variable="dq", from_=-0.1, to=0.1, share_of_error=0.6, share_of_samples=0.2, excess=0.4)
    assert where.to_json()["from"] == -0.1
    assert Where.model_validate(where.to_json()) == where
    speed = SpeedError(
        range="low",
        from_=0.0,
        to=0.1,
        relative_error=0.1,
        relative_error_validation=None,
        samples=3,
        joints=(),
    )
    assert SpeedError.model_validate(speed.to_json()) == speed


def test_the_number_of_a_session_stays_whole():
    where = Where(
        variable="session",
        from_=2,
        to=2,
        label="session-02.csv",
        share_of_error=0.6,
        share_of_samples=0.2,
        excess=0.4,
    )
    assert json.dumps(where.to_json()["from"]) == "2"


def test_constants_stand_beside_effect_and_joint_and_are_numbers():
    constants = EffectConstants.of("stribeck", "j3", {"stribeck_velocity": 0.1})
    assert constants.to_json() == {"effect": "stribeck", "joint": "j3", "stribeck_velocity": 0.1}
    assert constants.values == {"stribeck_velocity": 0.1}
    with pytest.raises(ValidationError):
        EffectConstants.of("stribeck", "j3", {"stribeck_velocity": "fast"})  # type: ignore[dict-item]


def test_what_is_changed_is_checked():
    document = ImprovementDocument(
        experiment="e",
        model="usual",
        steps=(Step(added=None, relative_error=0.1, relative_error_validation=None),),
        verdict="adequate",
    )
    assert document.changed(verdict="missing").verdict == "missing"
    with pytest.raises(ValidationError):
        document.changed(verdict="perhaps")


def test_an_effect_on_a_joint_is_spelled_as_on_the_command_line():
    assert str(EffectOnJoint(effect="viscous", joint="j3")) == "viscous@j3"


def test_every_part_is_a_part_and_every_document_has_a_format():
    for kind in WHOLE:
        assert issubclass(kind, Part)
        assert ("format" in kind.model_fields) == issubclass(kind, Document)
        assert hasattr(kind, "MADE_BY") == issubclass(kind, Document)
    assert JointDiagnosis.model_fields["learned"].default is None
