"""A mass that is not the payload's is refused: another payload hangs there, or the scale is not tared."""

import pytest

from daq.weighed_mass import require_mass
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

DISK = Payload(name="disk-7", mass=6.97, com=(0.0, 0.0, 0.1))


@pytest.mark.parametrize("mass", [6.97, 6.97 * 1.0049, 6.97 * 0.9951])
def test_half_a_percent_is_what_a_scale_may_differ_by(mass):
    require_mass(DISK, mass)


@pytest.mark.parametrize("mass", [6.97 * 1.0051, 6.9, 0.0, -6.97, float("nan")])
def test_more_is_refused_with_both_masses_named(mass):
    with pytest.raises(InputError, match=r"payload disk-7: weighs 6\.97 kg in the rig file"):
        require_mass(DISK, mass)


def test_a_light_payload_may_differ_by_five_grams():
    light = Payload(name="light", mass=0.02, com=(0.0, 0.0, 0.1))
    require_mass(light, 0.0249)
    with pytest.raises(InputError):
        require_mass(light, 0.0251)
