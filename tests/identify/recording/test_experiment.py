"""An experiment that is opened: by its folder, its file or a stored name."""

import pytest

from identify.recording import (
    InputError,
    load_experiment,
)


def test_a_folder_its_file_and_a_stored_name_are_one_experiment(folder):
    by_folder = load_experiment(folder)
    by_file = load_experiment(str(folder / "experiment.yaml"))
    by_name = load_experiment(folder.name, stored=folder.parent)
    assert by_folder == by_file == by_name
    assert by_folder.folder == folder


def test_what_is_nowhere_is_said_to_be_nowhere(tmp_path):
    with pytest.raises(InputError, match="no such folder or file"):
        load_experiment(tmp_path / "nowhere")
    with pytest.raises(InputError, match="nor an experiment of that name"):
        load_experiment("nowhere", stored=tmp_path)
    with pytest.raises(InputError, match=r"holds no experiment\.yaml"):
        load_experiment(tmp_path)


@pytest.mark.parametrize(("machine", "joints"), [("emps", 1), ("tx40", 6)])
def test_a_measured_experiment_is_used_as_it_was_recorded(machine, joints, request):
    experiment = load_experiment(request.getfixturevalue(machine))
    assert len(experiment.robot.joints) == joints
    for entry in experiment.sessions:
        session = experiment.read(entry)
        assert session.segments == (slice(0, len(session.time)),)
        assert session.remarks == ()
