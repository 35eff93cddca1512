"""What is known of a session's payload, whoever wrote it down."""

import pytest

from api.service.session_payload import UndescribedPayload, described, session_payload
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

DISK = Payload(name="disk", mass=3.4584, com=(1.277, 0.0, 0.0))


def test_a_payload_is_read_as_it_was_written():
    assert session_payload(DISK.model_dump(mode="json")) == DISK
    assert described(DISK) is DISK


@pytest.mark.parametrize(
    ("stated", "name"),
    [
        ({"name": "disk"}, "disk"),
        ({"name": "disk", "mass": "heavy"}, "disk"),
        ({"name": 7, "mass": 1.0}, "unknown"),
        ([1, 2], "unknown"),
        (None, "unknown"),
    ],
)
def test_what_a_file_does_not_say_is_not_known_and_nothing_is_driven_with_it(stated, name):
    payload = session_payload(stated)
    assert payload == UndescribedPayload(name=name)
    with pytest.raises(InputError, match=f"the mass of {name} is not known"):
        described(payload)
