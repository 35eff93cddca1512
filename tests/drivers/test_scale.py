"""The scale over a pseudo-terminal, against its simulated twin and against answers from the protocol's manual."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.errors import ScaleError
from drivers.scale import Scale
from drivers.simulated.scale import SimulatedScale


@pytest.fixture
def twin():
    with SimulatedScale() as simulated:
        yield simulated


@pytest.fixture
def scale(twin):
    with Scale(twin.port, timeout=0.3) as opened:
        yield opened


def test_a_stable_weight_is_given_in_kilograms(twin, scale):
    twin.load = 3.4584
    weight = scale.weigh()
    assert (weight.mass, weight.stable) == (pytest.approx(3.4584), True)
    assert weight.text.split() == ["S", "S", "3.4584", "kg"]


def test_an_unstable_weight_is_no_weight(twin, scale):
    twin.load, twin.at_rest = 2.0, False
    with pytest.raises(ScaleError, match="no stable weight in time: wait until the load is at rest"):
        scale.weigh()


@pytest.mark.parametrize(("load", "words"), [(13.0, "overload"), (-1.0, "underload")])
def test_too_much_and_too_little_are_told_apart(twin, scale, load, words):
    twin.load = load
    with pytest.raises(ScaleError, match=words):
        scale.weigh()


def test_after_zeroing_the_tare_is_gone(twin, scale):
    twin.load = 0.2
    scale.zero()
    twin.load = 3.6584
    assert scale.weigh().mass == pytest.approx(3.4584)


@pytest.mark.parametrize(
    ("load", "at_rest", "words"),
    [
        (5.0, True, "above the zero-setting range"),
        (-5.0, True, "below the zero-setting"),
        (0.0, False, "busy"),
    ],
)
def test_a_zero_that_is_refused_says_why(twin, scale, load, at_rest, words):
    twin.load, twin.at_rest = load, at_rest
    with pytest.raises(ScaleError, match=words):
        scale.zero()


@pytest.mark.parametrize(
    ("answer", "mass"),
    [
        ("S S     100.00 g", 0.1),
        ("S S      -1.25 g", -0.00125),
        ("S S  1.0000000 lb", 0.45359237),
        ("S S       2500 mg", 0.0025),
        ("S S    0.00350 t", 3.5),
    ],
)
def test_units_are_converted(twin, scale, answer, mass):
    twin.answer = answer
    assert scale.weigh().mass == pytest.approx(mass)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("ES", "does not understand the command"),
        ("ET", "garbled"),
        ("EL", "cannot carry out"),
        ("S S 12.3 pcs", "it weighs in 'pcs'; set it to g or kg"),
        ("S S 1.2.3 kg", "'1.2.3' is not a number"),
        ("hello", "'hello' is not a weight"),
        ("", "'' is not a weight"),
        ("S D 1.0 kg", "unstable"),
    ],
)
def test_every_other_answer_is_an_error_in_words(twin, scale, answer, words):
    twin.answer = answer
    with pytest.raises(ScaleError, match=words):
        scale.weigh()


def test_silence_is_an_error_after_the_stated_time(twin, scale):
    twin.silent = True
    with pytest.raises(ScaleError, match=r"no answer within 0\.3 s"):
        scale.weigh()


def test_an_unplugged_scale_is_an_error(twin, scale):
    twin.close()
    with pytest.raises(ScaleError, match=f"scale at {twin.port}"):
        scale.weigh()


def test_a_port_that_is_not_there_is_named():
    with pytest.raises(ScaleError, match="scale at /dev/no-scale: the port cannot be opened"):
        Scale("/dev/no-scale")


@settings(max_examples=200)
@given(line=st.text(st.characters(max_codepoint=255, exclude_characters="\r\n"), max_size=30))
def test_no_answer_whatsoever_gives_anything_but_a_weight_or_a_scale_error(line):
    scale = Scale.__new__(Scale)
    scale.port = "pty"
    try:
        weight = scale._weight(line)
    except ScaleError:
        return
    assert line.split()[:2] in (["S", "S"], ["S", "D"])
    assert isinstance(weight.mass, float)
