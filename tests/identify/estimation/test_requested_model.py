"""What the user asks for is found by its name or refused in one line; the Stribeck velocity between two that were tried."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from identify.estimation.record import Record
from identify.estimation.requested_model import (
    chosen_entries,
    known_effects,
    least_between,
    open_record,
    requested_model,
    with_payload_columns,
    with_unknown_payloads,
)
from identify.recording.errors import InputError
from tests.identify.estimation.simulated_arm import Arm, Motion, experiment, record


def samples(mass=0.0):
    return record(Motion(), Arm(), np.random.default_rng(3), duration=10.0, payload=mass)


@pytest.fixture(scope="module")
def three():
    """Sessions with nothing, with a disc, with a disc again, and a validation session with a bar."""
    made = {
        "a": (samples(), "none"),
        "b": (samples(3.0), "disc"),
        "c": (samples(3.0), "disc"),
        "v": (samples(5.0), "bar"),
    }
    return experiment(made, payloads=[("disc", 3.0), ("bar", 5.0)], roles={"v": "validation"})


@pytest.fixture(scope="module")
def opened(three):
    return open_record(three)


def refusal(of, *arguments):
    with pytest.raises(InputError) as refused:
        of(*arguments)
    return str(refused.value)


def test_sessions_are_chosen_by_what_they_carry(opened):
    assert [entry.file for entry in chosen_entries(opened, [])] == ["a", "b", "c"]
    assert [entry.file for entry in chosen_entries(opened, ["disc"])] == ["b", "c"]
    assert [entry.file for entry in chosen_entries(opened, ["none", "disc"])] == ["a", "b", "c"]
    assert (
        refusal(chosen_entries, opened, ["cup"])
        == "--payload cup: not declared; payloads are none, disc, bar"
    )
    assert refusal(chosen_entries, opened, ["bar"]) == "--payload bar: no identification session carries it"


def test_of_an_unknown_payload_nothing_is_declared(three):
    unknown = with_unknown_payloads(three, ["disc"])
    assert [(payload.name, payload.mass) for payload in unknown.payloads] == [
        ("none", 0),
        ("disc", 0),
        ("bar", 5),
    ]
    assert [entry.payload.mass for entry in unknown.sessions] == [0, 0, 0, 5]
    assert with_unknown_payloads(three, []) == three
    for names, said in (
        (["cup"], "--unknown-payload cup: not declared; payloads are none, disc, bar"),
        (["bar"], "--unknown-payload bar: no identification session carries it"),
        (
            ["none", "disc"],
            "--unknown-payload none, disc: every identification session carries what is not known",
        ),
    ):
        assert refusal(with_unknown_payloads, three, names).startswith(said)


def test_an_unknown_payload_has_ten_parameters_and_no_friction_by_load_beside_it(opened):
    usual = requested_model(opened, "usual")
    (term,) = [t for t in with_payload_columns(opened, usual, ["disc"]).terms if t not in usual.terms]
    assert (term.effect.name, dict(term.constants)) == ("unknown-payload", {"payload_1": 0.0})
    both = with_payload_columns(opened, usual, ["bar", "disc", "bar"]).terms[-1]
    assert dict(both.constants) == {"payload_2": 0.0, "payload_1": 1.0}
    assert with_payload_columns(opened, usual, []) is usual
    loaded = requested_model(opened, "usual", ["load-friction"])
    said = refusal(with_payload_columns, opened, loaded, ["disc"])
    assert said.startswith(
        "--unknown-payload: 'load-friction' needs the load, which an unknown payload is part of"
    )


def test_an_effect_that_the_record_cannot_show_is_refused_with_its_reason(opened):
    added = requested_model(opened, "usual", ["stribeck@j3", "joint-spring"])
    assert {term.key for term in added.terms} >= {("stribeck", 0), ("joint-spring", 0)}
    said = refusal(requested_model, opened, "usual", ["friction-temperature"])
    assert re.match("--add friction-temperature: this record cannot show it: .*temperature", said)


def test_a_record_without_torque_of_a_joint_is_refused_by_its_column(three):
    silent = replace(samples(), command=np.zeros((5000, 1)))
    assert refusal(open_record, experiment({"a": (silent, "none")})) == (
        "memory/a: column 'v1' is zero throughout: no torque of joint 'j3' was recorded"
    )
    one_of_two = experiment({"a": (silent, "none"), "b": (samples(), "disc")}, payloads=[("disc", 0.0)])
    half = Record.of(one_of_two)
    assert [entry.file for entry in chosen_entries(half, [])] == ["a", "b"]
    assert "memory/a: column 'v1' is zero" in refusal(chosen_entries, half, ["none"])


def own_effect(path, name, column):
    path.write_text(f"name: {name}\ncolumns: ['{column}']\n", encoding="utf-8")
    return path


def test_effects_of_ones_own_are_known_beside_the_catalogue_and_fit_the_robot(three, tmp_path):
    mine = own_effect(tmp_path / "mine.yaml", "mine", "q**2")
    assert set(known_effects(replace(three, effects=(mine,)))) == {*known_effects(three), "mine"}
    taken = own_effect(tmp_path / "taken.yaml", "stribeck", "q**2")
    assert refusal(known_effects, replace(three, effects=(taken,))) == (
        f"{taken}: name: an effect named 'stribeck' is already in the catalogue"
    )
    beyond = own_effect(tmp_path / "beyond.yaml", "beyond", "q2 * q3")
    assert refusal(known_effects, replace(three, effects=(beyond,))) == (
        f"{beyond}: columns: 'q2': the robot has 1 joints, q1 to q1"
    )


@pytest.mark.parametrize("least", [0.11, 0.2, 0.31])
def test_the_least_error_lies_where_a_parabola_over_the_logarithm_has_it(least):
    values = np.geomspace(0.05, 0.8, 5)
    squares = 2.0 + np.log(values / least) ** 2
    assert least_between(values, np.sqrt(squares)) == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize(
    ("errors", "place"), [([1, 2, 3, 4], 0), ([4, 3, 2, 1], 3), ([2, 1, 1, 1], 1), ([3, 1, 1.0000001, 3], 1)]
)
def test_at_the_ends_of_what_was_tried_and_where_nothing_tells_the_least_error_is_the_one_tried(
    errors, place
):
    values = np.array([0.1, 0.2, 0.4, 0.8])
    found = least_between(values, np.array(errors, float))
    lowest, highest = values[max(place - 1, 0)], values[min(place + 1, 3)]
    assert lowest <= found <= highest
    if place in (0, 3):
        assert found == values[place]


def test_a_command_that_never_changes_while_the_joint_moves_is_refused_and_one_that_does_between_sessions_is_not():
    """An offset alone explains it: 0.00 % of error, and nothing learnt."""
    stuck = replace(samples(), command=np.full((5000, 1), 2.5))
    said = refusal(open_record, experiment({"a": (stuck, "none"), "b": (stuck, "none")}))
    assert said == (
        "memory/a: column 'v1' is 2.5 throughout while joint 'j3' moves: a torque that never changes tells an offset and nothing"
        " else; record the command that moves the joint"
    )
    other = replace(samples(), command=np.full((5000, 1), 2.6))
    open_record(experiment({"a": (stuck, "none"), "b": (other, "none")}))
    pushed = replace(stuck, external=np.sin(stuck.time)[:, None])
    open_record(experiment({"a": (pushed, "none")}))
