"""A rig file altered anywhere is a rig, or is refused in one line that names the file; nothing else comes of it."""

import copy

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from daq.rig import RIGS, Rig, rig_names
from identify.recording.errors import InputError
from tests.altered_document import altered

DOCUMENTS = [yaml.safe_load((RIGS / f"{name}.yaml").read_text()) for name in rig_names()]
TEXTS = [(RIGS / f"{name}.yaml").read_bytes() for name in rig_names()]
MANY = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def is_taken_or_refused(path):
    try:
        rig = Rig.load(path)
    except InputError as refused:
        assert len(str(refused).splitlines()) == 1, str(refused)  # noqa: PT017 - it may also be taken
        assert str(path) in str(refused)  # noqa: PT017
        return
    assert rig.drive_gain.shape == (len(rig.axes), len(rig.axes))


@MANY
@given(document=st.sampled_from(DOCUMENTS).flatmap(altered))
def test_a_rig_that_is_altered_in_a_field_is_taken_or_refused_in_a_line(tmp_path, document):
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(document, allow_unicode=True), encoding="utf-8", errors="surrogatepass")
    is_taken_or_refused(path)


def test_gears_of_very_different_ratios_make_a_rig(tmp_path):
    """An integer of any size is one of the alterations; beside an ordinary ratio it once passed for a singular matrix."""
    document = next(copy.deepcopy(each) for each in DOCUMENTS if len(each["axes"]) > 1)
    document["axes"][0]["gear_ratio"] = 938_539_184_000_000_000
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(document, allow_unicode=True), encoding="utf-8")
    is_taken_or_refused(path)


@MANY
@given(
    text=st.sampled_from(TEXTS), place=st.floats(0, 1), inserted=st.binary(max_size=6), cut=st.integers(0, 40)
)
def test_a_rig_file_that_is_damaged_is_taken_or_refused_in_a_line(tmp_path, text, place, inserted, cut):
    path, at = tmp_path / "rig.yaml", int(place * len(text))
    path.write_bytes(text[:at] + inserted + text[at + cut :])
    is_taken_or_refused(path)


@pytest.mark.parametrize("name", rig_names())
def test_the_rigs_that_are_altered_are_taken_as_they_are(name):
    is_taken_or_refused(RIGS / f"{name}.yaml")
