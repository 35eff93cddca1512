import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from drivers.drive_gain import drive_gain, is_singular


def test_joint_3_of_the_rx130l_has_the_drive_gain_of_the_paper():
    """N = 95, K_t = 0.37 N m/A: 35.15 N m per A, section IV of the paper."""
    assert drive_gain(95.0, "A", torque_constant=0.37) == pytest.approx(np.array([[35.15]]))


def test_an_analogue_amplifier_multiplies_by_its_gain():
    gain = drive_gain([95.0], "V", torque_constant=[0.37], amplifier_gain=[2.0])
    assert gain == pytest.approx(np.array([[70.30]]))


def test_per_mille_of_rated_torque_and_of_rated_current_agree_for_a_constant_torque_constant():
    by_torque = drive_gain([50.0], "rated torque", rated_torque=[1.5])
    by_current = drive_gain([50.0], "rated current", rated_current=[5.0], torque_constant=[0.3])
    assert by_torque == pytest.approx(by_current)


@given(
    arrays(float, (3, 3), elements=st.floats(-2, 2)),
    arrays(float, 3, elements=st.floats(-5, 5)),
    arrays(float, 3, elements=st.floats(-3, 3)),
)
def test_power_at_the_joints_is_power_at_the_motors(coupling, current, velocity):
    """tau' dq = (K_t i)' (N dq): what defines the transpose in eq. (4) for coupled axes."""
    ratio = coupling + 10 * np.eye(3)
    torque_constant = np.array([0.1, 0.2, 0.3])
    torque = drive_gain(ratio, "A", torque_constant=torque_constant) @ current
    assert torque @ velocity == pytest.approx((torque_constant * current) @ (ratio @ velocity), abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([50.0], "A"), r"needs torque_constant \(N m/A\)"),
        (([50.0], "mA", {"torque_constant": [1.0]}), "not known: A, V, N m"),
        (([50.0], "N m", {"torque_constant": [1.0]}), "has no use for torque_constant"),
        (([50.0, 20.0], "A", {"torque_constant": [1.0, 2.0, 3.0]}), "must have 2 values, not 3"),
        (([50.0], "A", {"torque_constant": [0.0]}), "must be finite and not zero"),
        (([0.0], "N m"), "singular"),
        (([[1.0, 2.0]], "N m"), r"\(n, n\), not \(1, 2\)"),
    ],
)
def test_quantities_that_do_not_fit_are_refused(arguments, words):
    ratio, unit, *rest = arguments
    with pytest.raises(ValueError, match=words):
        drive_gain(ratio, unit, **(rest[0] if rest else {}))


def test_gears_of_very_different_ratios_are_not_singular_and_motors_that_move_alike_are():
    np.testing.assert_array_equal(drive_gain([45.0, 9.4e17], "N m"), np.diag([45.0, 9.4e17]))
    np.testing.assert_array_equal(drive_gain([1e-13, 45.0], "N m"), np.diag([1e-13, 45.0]))
    assert is_singular(np.array([[1.0, 1.0], [1e6, 1e6]]))
    assert is_singular(np.array([[1.0, 0.0], [0.0, 0.0]]))
    # the angle between the two rows, about 1.4e-9 and 0.7e-9 of a singular value
    assert not is_singular(np.array([[1.0, 1.0], [1.0, 1.0 + 4e-9]]))
    assert is_singular(np.array([[1.0, 1.0], [1.0, 1.0 + 1e-9]]))
