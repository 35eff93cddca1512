"""Numbers on the pages."""

from api.pages.number_format import (
    certainty,
    duration,
    equation,
    listing,
    number,
    percent,
    probability,
    significant,
    symbol,
    unit,
    with_commands,
    with_deviation,
)


def test_a_figure_that_cannot_be_given_is_a_dash() -> None:
    assert {number(None), significant(None), percent(None), duration(None), str(probability(None))} == {"–"}
    assert percent(float("nan")) == "–"


def test_minus_is_a_minus_sign_and_zero_has_none() -> None:
    assert number(-1.5, 1) == "−1.5"
    assert number(-0.001, 2) == "0.00"


def test_significant_digits_survive_the_magnitude() -> None:
    assert significant(0.0123456) == "0.0123"
    assert significant(101.43) == "101"
    assert significant(1.5e7, 2) == "1.5\u202f×\u202f10⁷"
    assert significant(0) == "0"


def test_a_value_has_the_decimals_of_its_deviation() -> None:
    assert with_deviation(30.9213, 0.14) == "30.92"
    assert with_deviation(30.9213, 2.4) == "30.9"
    assert with_deviation(0.92244, 0.0031) == "0.9224"
    assert with_deviation(12.3456, None) == "12.35"


def test_percent_keeps_two_decimals_below_ten() -> None:
    assert percent(0.0733) == "7.33\u202f%"
    assert percent(0.34) == "34.0\u202f%"
    assert percent(0.87, 2) == "87\u202f%"


def test_a_small_probability_is_an_order_of_magnitude() -> None:
    assert str(probability(1e-30)) == "&lt;\u202f10<sup>−12</sup>"
    assert str(probability(2e-7)) == "&lt;\u202f10<sup>−6</sup>"
    assert str(probability(0.04)) == "0.040"


def test_a_probability_is_never_certain() -> None:
    shown = [certainty(value).replace("\u202f", " ") for value in (0.0, 0.004, 0.006, 0.98, 0.997, 1.0, None)]
    assert shown == ["< 1 %", "< 1 %", "1 %", "98 %", "> 99 %", "> 99 %", "–"]


def test_a_parameter_has_the_symbol_of_its_equation() -> None:
    shown = [str(symbol(name)) for name in ("alpha_m1", "beta_difference12", "mass_ratio[disk-7]", "FS3")]
    assert shown == ["α<sub>m</sub>", "β<sub>m</sub> − β<sub>g</sub>", "M<sub>ae</sub>/M<sub>aw</sub>", ""]


def test_formulas_get_their_subscripts_and_stay_safe() -> None:
    assert str(equation("F_V q̇ < c_m")) == "F<sub>V</sub> q̇ &lt; c<sub>m</sub>"
    assert unit("kg m^2") == "kg m²"


def test_durations_and_lists_read_as_said() -> None:
    assert duration(185) == "3\u202fmin 05\u202fs"
    assert listing(["a", "b", "c"]) == "a, b and c"
    assert listing(["a", "b, more than c", "d"]) == "a; b, more than c; and d"


def test_a_command_in_a_message_has_its_typeface_and_nothing_else_is_markup():
    said = with_commands("not <b>homed</b>; `coulomb home R&D` homes it, or ` alone")
    assert said == "not &lt;b&gt;homed&lt;/b&gt;; <code>coulomb home R&amp;D</code> homes it, or ` alone"
