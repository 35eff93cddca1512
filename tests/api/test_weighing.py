"""The scale of a lab: without one masses are typed; what it says is passed on."""

import pytest

import drivers.scale
from api.service.problems import Problem
from api.service.weighing import WeighingScale
from drivers.errors import ScaleError


class Twin:
    """A scale with 3.5 kg on it, or one that says why it cannot weigh."""

    def __init__(self, port: str) -> None:
        self.port = port

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None

    def weigh(self):
        if self.port == "overloaded":
            raise ScaleError("the scale is overloaded")
        return self

    mass = 3.5


@pytest.fixture(autouse=True)
def twin(monkeypatch):
    monkeypatch.setattr(drivers.scale, "Scale", Twin)


def test_without_a_scale_the_mass_is_typed():
    with pytest.raises(Problem, match="type the mass") as problem:
        WeighingScale(None).weigh()
    assert problem.value.status == 409


def test_the_stable_weight_is_given():
    assert WeighingScale("bench").weigh() == 3.5


def test_a_scale_that_gives_no_weight_says_why_and_what_to_do():
    with pytest.raises(Problem, match=r"the scale is overloaded\. Try again, or type the mass") as problem:
        WeighingScale("overloaded").weigh()
    assert problem.value.status == 503
