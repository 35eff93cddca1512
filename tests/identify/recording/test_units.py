"""Units and their factors against definitions written out here, and names with units in them."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.recording.units import SI_NAMES, in_brackets, split_name, unit_of

TURN = 2 * pi
DEFINED = {
    "s": ("time", 1), "ms": ("time", 1e-3), "µs": ("time", 1e-6), "100ns": ("time", 1e-7), "ns": ("time", 1e-9),
    "min": ("time", 60), "h": ("time", 3600), "days": ("time", 24 * 3600),
    "rad": ("angle", 1), "mrad": ("angle", 1e-3), "deg": ("angle", TURN / 360), "°": ("angle", TURN / 360),
    "mdeg": ("angle", TURN / 360_000), "rev": ("angle", TURN), "Umdrehungen": ("angle", TURN),
    "m": ("length", 1), "cm": ("length", 1e-2), "mm": ("length", 1e-3), "um": ("length", 1e-6), "inch": ("length", 0.0254),
    "rad/s": ("angular velocity", 1), "deg/s": ("angular velocity", TURN / 360), "dps": ("angular velocity", TURN / 360),
    "rpm": ("angular velocity", TURN / 60), "1/min": ("angular velocity", TURN / 60), "rps": ("angular velocity", TURN),
    "m/s": ("velocity", 1), "mm/s": ("velocity", 1e-3),
    "A": ("current", 1), "mA": ("current", 1e-3), "V": ("voltage", 1), "mV": ("voltage", 1e-3),
    "kNm": ("torque", 1e3), "N m": ("torque", 1), "N·m": ("torque", 1), "N-m": ("torque", 1), "Ncm": ("torque", 1e-2),
    "mNm": ("torque", 1e-3), "Nmm": ("torque", 1e-3), "µNm": ("torque", 1e-6),
    "kN": ("force", 1e3), "N": ("force", 1), "mN": ("force", 1e-3),
    "%": ("ratio", 1), "‰": ("ratio", 0.1), "counts": ("counts", 1), "°C": ("temperature", 1),
}  # fmt: skip


@pytest.mark.parametrize("text", DEFINED)
def test_a_unit_has_its_quantity_and_its_factor_to_si(text):
    quantity, factor = DEFINED[text]
    unit = unit_of(text)
    assert unit is not None
    assert unit.quantity == quantity
    assert unit.quantity in SI_NAMES
    assert unit.to_si(3.0) == pytest.approx(3.0 * factor, rel=1e-12)


@pytest.mark.parametrize(("text", "boiling"), [("°C", 100.0), ("K", 373.15), ("°F", 212.0)])
def test_temperatures_have_their_zero(text, boiling):
    assert unit_of(text).to_si(boiling) == pytest.approx(100.0)


@pytest.mark.parametrize("text", ["furlong", "", "q", "[]"])
def test_what_is_no_unit_is_none(text):
    assert unit_of(text) is None


def test_a_capital_letter_matters_where_two_units_differ_by_it_alone():
    assert unit_of("mNm").factor == 1e-3
    assert unit_of("MA").name == "mA"  # nobody means megaamperes
    assert unit_of("RPM").name == "rpm"


@pytest.mark.parametrize(
    ("name", "bare", "unit"),
    [
        ("pos [deg]", "pos", "deg"),
        ("pos(deg)", "pos", "deg"),
        ("pos {rad}", "pos", "rad"),
        ("pos <mm>", "pos", "mm"),
        ("motor current [A]", "motor current", "A"),
        ("torque / N m", "torque", "Nm"),
        ("speed in rpm", "speed", "rpm"),
        ("pos_deg", "pos", "deg"),
        ("arm_pos_deg", "arm_pos", "deg"),
        ("log.meas.t_ms", "log.meas.t", "ms"),
        ("drive.rpm", "drive", "rpm"),
        ("time_us", "time", "us"),
        ("q_m", "q_m", None),
        ("axis [1]", "axis [1]", None),
        ("[deg]", "[deg]", None),
        ("v / t", "v / t", None),
        ("position", "position", None),
    ],
)
def test_a_name_is_parted_from_its_unit(name, bare, unit):
    found, of = split_name(name)
    assert found == bare
    assert (of.name if of else None) == unit


@given(st.lists(st.floats(-1e6, 1e6), max_size=5))
def test_columns_are_turned_into_si_as_a_whole(values):
    np.testing.assert_allclose(unit_of("deg").to_si(values), np.deg2rad(values), rtol=1e-12)


def test_an_index_in_brackets_is_no_unit():
    assert in_brackets("/joint_states/position[0]") == ""
    assert in_brackets("position [grd]") == "grd"
