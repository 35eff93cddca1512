"""The file of a description is the effect itself."""

from __future__ import annotations

import pytest

from identify.diagnosis.learned_document import effect_file
from identify.effects.expression import load_own_effect
from identify.effects.learned_forms import closed_forms, tables, variables_of
from tests.identify.effects.summaries import summary_of

SUMMARY = summary_of()


@pytest.mark.parametrize("name", ["q", "dq", "load", "time"])
def test_what_is_written_is_read_as_the_same_effect(tmp_path, name):
    over = next(each for each in variables_of(SUMMARY, [SUMMARY]) if each.name == name)
    for place, each in enumerate([*tables(over, SUMMARY), *closed_forms(over, "turned", SUMMARY)]):
        path = tmp_path / f"{place}.yaml"
        path.write_text(effect_file(each.effect.settings), encoding="utf-8")
        assert load_own_effect(path).settings == each.effect.settings
