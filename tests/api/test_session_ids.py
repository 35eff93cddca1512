"""Sessions are called after their files, drives of proofs after their proof; no file takes a drive's id."""

from hypothesis import given, settings
from hypothesis import strategies as st

from api.service.session_ids import DRIVE_ID, drive_id, session_id

names = st.one_of(
    st.from_regex(r"(file-){0,3}proof-[0-9]{1,4}-(with|without)", fullmatch=True),
    st.text(st.characters(exclude_characters="/"), min_size=1, max_size=20),
)


def test_a_file_is_called_by_its_name_without_the_ending():
    assert session_id("session-00.h5") == "session-00"
    assert session_id("2024-05-01.run.csv.gz") == "2024-05-01.run"


@settings(max_examples=40)
@given(names, names)
def test_no_file_has_a_drive_s_id_and_no_two_names_the_same(first, second):
    ids = [session_id(f"{name}.csv") for name in (first, second)]
    assert not any(DRIVE_ID.fullmatch(each) for each in ids)
    if session_id(f"{first}.csv") == session_id(f"{second}.csv"):
        assert first == second
    assert drive_id("00", "with") not in ids


def test_a_recording_that_is_called_like_a_drive_is_a_session_of_the_experiment(
    service, data_folder, write_measured_experiment
):
    folder = write_measured_experiment(data_folder / "experiments" / "by-hand", sessions=1)
    (folder / "session-00.csv").rename(folder / "proof-00-with.csv")
    file = folder / "experiment.yaml"
    file.write_text(file.read_text().replace("session-00.csv", "proof-00-with.csv"))
    store = service.service.experiments
    store.reindex()
    assert [row.id for row in store.sessions("by-hand")] == ["file-proof-00-with"]
    assert store.session_place("by-hand", "file-proof-00-with")[1].file == "proof-00-with.csv"
