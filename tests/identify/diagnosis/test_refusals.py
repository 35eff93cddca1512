"""What a search took out may come back when that which it was taken out beside leaves, once."""

from __future__ import annotations

from dataclasses import dataclass

from identify.diagnosis.refusals import Refusals


@dataclass(frozen=True)
class NamedTerm:
    """What is asked of a term."""

    key: tuple[str, int]


FRICTION, GAIN, SPRING = NamedTerm(("friction", 0)), NamedTerm(("gain", 0)), NamedTerm(("spring", 1))


def test_what_was_taken_out_beside_another_comes_back_when_that_one_leaves_and_then_never_again():
    refusals = Refusals()
    refusals.refuse(FRICTION, 0, [(FRICTION, 0), (GAIN, 0), (SPRING, 1)])
    assert refusals.present([(GAIN, 0), (SPRING, 1)]) == {FRICTION.key}
    assert refusals.present([(GAIN, 0)]) == {FRICTION.key}  # another joint's terms do not matter
    refusals.refuse(GAIN, 0, [])
    assert refusals.present([]) == {GAIN.key}
    refusals.refuse(FRICTION, 0, [(SPRING, 1), (GAIN, 0)])
    assert refusals.present([]) == {GAIN.key, FRICTION.key}


def test_what_was_refused_alone_or_from_the_beginning_stays_so():
    refusals = Refusals({SPRING.key})
    refusals.refuse(FRICTION, 0, [(FRICTION, 0), (SPRING, 1)])
    for added in ([], [(GAIN, 0)], [(SPRING, 1)]):
        assert refusals.present(added) == {SPRING.key, FRICTION.key}
