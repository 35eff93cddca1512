"""`coulomb fake-drive`: how it refuses. On a bus: tests/vcan."""

import pytest

from api.commands.fake_drive import fake_drive
from identify.recording.errors import InputError

SIMULATED = "rx130l-joint3-simulated"


@pytest.mark.parametrize(
    ("rig", "arguments", "words"),
    [
        ("no-such-rig", {}, "rig 'no-such-rig' is not known"),
        (SIMULATED, {}, "--interface: a virtual bus ends with this process"),
        (SIMULATED, {"interface": "socketcan", "channel": "can99"}, "--channel can99: .* is not there"),
        (SIMULATED, {"interface": "socketcan", "payload": "anvil"}, "payload 'anvil' is not known"),
        (SIMULATED, {"interface": "socketcan", "seconds": -1.0}, "--seconds: must be above 0"),
    ],
)
def test_fake_drive_refuses_wrong_arguments_by_name(rig, arguments, words):
    with pytest.raises(InputError, match=words):
        fake_drive(rig, **arguments)
