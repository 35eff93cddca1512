"""The sample of mutants is fixed by its seed, and a record of verdicts is read as it was written."""

from __future__ import annotations

from tests.mutants.__main__ import Record, drawn
from tests.mutants.trial import Verdict

LINES = [f"value_{k} = {k} + x * {k}" for k in range(40)]


def tree(root, one, other):
    (root / "room").mkdir(parents=True)
    (root / "room" / "one.py").write_text("\n".join(one) + "\n")
    (root / "room" / "other.py").write_text("\n".join(other) + "\n")
    return root


def identities(root, seed=7):
    return [each.identity for each in drawn(root, ["room"], 40, seed)]


def test_the_seed_fixes_the_sample_and_another_seed_draws_another(tmp_path):
    root = tree(tmp_path, LINES, LINES)
    assert len(set(identities(root))) == 40
    assert identities(root) == identities(root)
    assert identities(root, 8) != identities(root)


def test_a_changed_module_changes_only_what_is_drawn_of_it_and_at_the_sample_s_edge(tmp_path):
    before = identities(tree(tmp_path / "before", LINES, LINES))
    after = identities(tree(tmp_path / "after", ["moved = 1", "", *LINES[:-1]], LINES))
    assert len(set(before) & set(after)) >= 37
    assert len(after) == 40


def test_lines_that_stand_twice_are_two_mutants_each(tmp_path):
    root = tree(tmp_path, ["a = b + c", "a = b + c"], [])
    assert [identity[-2:] for identity in identities(root)] == ["#0", "#1"]


def test_a_record_keeps_the_last_verdict_of_each_mutant(tmp_path):
    path = tmp_path / "record.jsonl"
    record = Record(path)
    record.keep("a", Verdict("survived", 3.0))
    record.keep("b", Verdict("noticed", 1.0, "test_b"))
    record.keep("a", Verdict("noticed", 2.0, "test_a"))
    assert Record(path).verdicts == {
        "a": Verdict("noticed", 2.0, "test_a"),
        "b": Verdict("noticed", 1.0, "test_b"),
    }
    assert Record.of(None).verdicts == {}
