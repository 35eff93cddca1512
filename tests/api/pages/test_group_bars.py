"""Bars of the relative error by payload or session: from zero, in proportion, and one thin row beneath each."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree

import pytest

from api.pages.figures.group_bars import draw_group_bars

SVG = "{http://www.w3.org/2000/svg}"


def drawn(groups, **options):
    """Bars (x, y, width, class), texts, and what is said of the rows for a choice of samples."""
    root = ElementTree.fromstring(str(draw_group_bars(groups, "payload", **options)))
    bars = [
        (*(float(rect.get(key)) for key in ("x", "y", "width")), rect.get("class"))
        for rect in root.iter(f"{SVG}rect")
    ]
    return bars, [text.text for text in root.iter(f"{SVG}text")], json.loads(root.get("data-groups")), root


def test_bars_begin_at_one_line_and_are_as_long_as_their_errors():
    bars, _, rows, root = drawn([("none", [0.02, 0.04]), ("disc", [0.01, None])])
    assert {x for x, *_ in bars} == {112.0}
    assert [width for _, _, width, _ in bars] == pytest.approx([123.0, 246.0, 61.5], abs=0.06)
    assert [class_ for *_, class_ in bars] == ["bar-error", "bar-before", "bar-error"]
    assert rows["ends"] == [0.0, 0.04]
    assert rows["at"] == [112.0, 358.0]
    assert root.get("aria-label") == "Relative error by payload"


def test_each_group_has_a_row_for_each_model_and_room_for_the_chosen_samples_beneath():
    bars, _, rows, root = drawn([("none", [0.02, 0.04]), ("disc", [0.01, 0.01])])
    tops = [y for _, y, _, _ in bars]
    assert tops == sorted(tops)
    assert tops[1] - tops[0] == tops[3] - tops[2] == 13.0
    for name, below, before in (
        ("none", tops[1] + 10, tops[2]),
        ("disc", tops[3] + 10, float(root.get("viewBox").split()[3])),
    ):
        assert below < rows["rows"][name] < before


def test_what_has_no_samples_says_so_and_long_names_are_cut():
    _, texts, _, _ = drawn([("a payload with a name that is long", [None]), ("eighteen letters..", [0.5])])
    assert texts[:2] == ["a payload with a …", "no samples"]
    assert "eighteen letters.." in texts
    assert any(text.startswith("50.0") for text in texts)


def test_errors_of_nothing_and_no_groups_at_all_are_drawn():
    bars, *_ = drawn([("none", [0.0])])
    assert [width for _, _, width, _ in bars] == [0.0]
    bars, texts, rows, _ = drawn([])
    assert (bars, texts, rows["rows"]) == ([], [], {})
