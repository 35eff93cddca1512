"""Who operates a rig and who watches it, on a clock of the test's own."""

from types import SimpleNamespace

import pytest

from api.service.accounts import Role, User
from api.service.problems import Problem
from api.service.rig_operators import RigOperators

ADA, GRACE, VERA = (User(name, Role.OPERATOR, "sign-in") for name in ("ada", "grace", "vera"))


class Rigs:
    """Operators of rigs of which the test says which one moves."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.moving: set[str] = set()
        claims = SimpleNamespace(moves=lambda rig: rig in self.moving)
        self.operators = RigOperators(claims, lambda: self.now)


@pytest.fixture
def rigs() -> Rigs:
    return Rigs()


def refused(words: str):
    return pytest.raises(Problem, match=words)


def test_one_operator_at_a_time_and_each_rig_has_its_own(rigs):
    assert rigs.operators.operator("arm") is None
    rigs.operators.take("arm", ADA)
    rigs.operators.take("arm", ADA)
    with refused("ada operates the rig arm") as problem:
        rigs.operators.take("arm", GRACE)
    assert problem.value.status == 409
    rigs.operators.take("wrist", GRACE)
    assert [rigs.operators.operator(rig) for rig in ("arm", "wrist")] == ["ada", "grace"]


def test_a_rig_at_rest_is_free_after_a_quarter_of_an_hour_of_silence(rigs):
    rigs.operators.take("arm", ADA)
    rigs.now += 15 * 60.0
    assert rigs.operators.operator("arm") == "ada"
    rigs.now += 1.0
    assert rigs.operators.operator("arm") is None
    rigs.operators.take("arm", GRACE)


def test_asking_for_the_state_is_a_request_of_the_operator_and_of_nobody_else(rigs):
    rigs.operators.take("arm", ADA)
    for _ in range(3):
        rigs.now += 600.0
        rigs.operators.watch("arm", ADA)
    assert rigs.operators.operator("arm") == "ada"
    rigs.now += 600.0
    rigs.operators.watch("arm", GRACE)
    rigs.now += 600.0
    assert rigs.operators.operator("arm") is None


def test_a_rig_that_moves_keeps_its_operator_however_long(rigs):
    rigs.operators.take("arm", ADA)
    rigs.moving.add("arm")
    rigs.now += 1e6
    assert rigs.operators.operator("arm") == "ada"
    with refused("armed or running"):
        rigs.operators.release("arm", ADA)
    rigs.operators.hand_over("arm", ADA, "grace")
    assert rigs.operators.operator("arm") == "grace"


def test_only_its_operator_gives_a_rig_back_or_on(rigs):
    with refused("Nobody operates the rig arm, not ada"):
        rigs.operators.release("arm", ADA)
    rigs.operators.take("arm", ADA)
    with refused("ada operates the rig arm, not grace"):
        rigs.operators.release("arm", GRACE)
    with refused("ada operates the rig arm, not grace"):
        rigs.operators.hand_over("arm", GRACE, "grace")
    rigs.operators.release("arm", ADA)
    assert rigs.operators.operator("arm") is None


def test_a_turn_has_a_number_of_its_own(rigs):
    turns = []
    rigs.operators.take("arm", ADA)
    turns.append(rigs.operators.tenure("arm"))
    rigs.operators.take("arm", ADA)
    rigs.operators.hand_over("arm", ADA, "ada")
    assert rigs.operators.tenure("arm") == turns[0]
    rigs.operators.hand_over("arm", ADA, "grace")
    turns.append(rigs.operators.tenure("arm"))
    rigs.operators.release("arm", GRACE)
    rigs.operators.take("arm", GRACE)
    turns.append(rigs.operators.tenure("arm"))
    assert turns == [turns[0], turns[0] + 1, turns[0] + 2]


def test_onlookers_are_who_asked_within_half_a_minute_or_has_a_live_view_open(rigs):
    rigs.operators.take("arm", ADA)
    for user in (ADA, VERA, GRACE):
        rigs.operators.watch("arm", user)
    assert rigs.operators.onlookers("arm") == ["grace", "vera"]
    assert rigs.operators.onlookers("wrist") == []
    rigs.now += 29.0
    rigs.operators.watch("arm", VERA)
    rigs.now += 1.0
    assert rigs.operators.onlookers("arm") == ["vera"]
    rigs.now += 30.0
    for change, seen in ((1, ["grace"]), (1, ["grace"]), (-1, ["grace"]), (-1, [])):
        rigs.operators.watch_live("arm", GRACE, change)
        assert rigs.operators.onlookers("arm") == seen
