"""How many uploads are taken in at the same time."""

import pytest

from api.service.upload_slots import MOST, UploadSlots


def test_all_together_have_a_bounded_number_of_uploads():
    slots = UploadSlots()
    entered = [slots.taken(f"user{number}") for number in range(MOST)]
    for each in entered:
        each.__enter__()
    with pytest.raises(Exception, match="Other uploads"), slots.taken("another"):
        pass
    entered[0].__exit__(None, None, None)
    with slots.taken("another"):
        pass
