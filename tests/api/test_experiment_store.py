"""Folders are the truth; the index follows them."""

import shutil

import pytest

from api.service.accounts import Role
from api.service.experiment_store import ExperimentStore, id_from_name
from api.service.problems import Problem
from api.stored_experiments import EXPERIMENT_ID, resolve
from identify.recording.errors import InputError


@pytest.fixture
def client(service):
    return service.client(Role.OPERATOR)


def test_a_lost_database_is_rebuilt_from_the_folders(
    service, client, start_service, data_folder, write_measured_experiment
):
    write_measured_experiment(data_folder / "experiments" / "by-hand")
    client.post("/experiments", json={"name": "arm", "rig": "rx130l-joint3-simulated"})
    assert service.service.experiments.reindex() == 2
    before = [client.get(f"/experiments/{identifier}").json() for identifier in ("by-hand", "arm")]
    for file in data_folder.glob("service.sqlite*"):
        file.unlink()
    again = start_service().client(Role.VIEWER)
    assert [again.get(f"/experiments/{identifier}").json() for identifier in ("by-hand", "arm")] == before


def test_reindexing_keeps_accounts_and_audit_log_and_drops_what_is_gone(service, client):
    client.post("/experiments", json={"name": "arm", "rig": "rx130l-joint3-simulated"})
    shutil.rmtree(service.service.experiments.folder("arm"))
    assert client.get("/experiments/arm").status_code == 404
    assert service.service.experiments.reindex() == 0
    assert client.get("/experiments").json() == []
    assert [user.name for user in service.service.accounts.users()] == ["the-operator"]
    assert len(service.service.audit.rows()) == 1


def test_an_edited_experiment_file_is_seen_at_once(service, client, data_folder, write_measured_experiment):
    folder = write_measured_experiment(data_folder / "experiments" / "by-hand")
    service.service.experiments.reindex()
    file = folder / "experiment.yaml"
    file.write_text(file.read_text().replace("name: pendulum", "name: swing"))
    assert client.get("/experiments/by-hand").json()["name"] == "swing"


def test_folders_that_are_no_experiments_are_left_alone(service, data_folder):
    root = data_folder / "experiments"
    (root / ".incoming-x").mkdir()
    (root / "Notes").mkdir()
    (root / "Notes" / "experiment.yaml").write_text("format: 1")
    (root / "empty").mkdir()
    assert service.service.experiments.reindex() == 0


def test_what_is_being_put_together_is_removed_when_it_fails(service, data_folder):
    store: ExperimentStore = service.service.experiments

    def fail_half_way():
        with store.incoming() as folder:
            (folder / "half.csv").write_text("t")
            raise OSError("the disk is full")

    with pytest.raises(OSError, match="full"):
        fail_half_way()
    assert list((data_folder / "experiments").iterdir()) == []


@pytest.mark.parametrize(
    ("name", "identifier"),
    [
        ("RX130L, joint 3", "rx130l-joint-3"),
        ("Größe", "groe"),
        ("../../etc", "etc"),
        ("日本", "experiment"),
        ("-x-", "x"),
        ("a" * 200, "a" * 50),
    ],
)
def test_an_id_is_readable_and_never_a_path(name, identifier):
    assert id_from_name(name) == identifier
    assert EXPERIMENT_ID.fullmatch(identifier)


def test_every_command_takes_a_folder_a_file_or_the_name_of_a_stored_experiment(
    tmp_path, write_measured_experiment
):
    folder = write_measured_experiment(tmp_path / "data" / "experiments" / "pendulum")
    assert resolve(folder, tmp_path / "data") == folder
    assert resolve(folder / "experiment.yaml", tmp_path / "data") == folder / "experiment.yaml"
    assert resolve("pendulum", tmp_path / "data") == folder
    with pytest.raises(InputError, match="stored are: pendulum"):
        resolve("unknown", tmp_path / "data")
    with pytest.raises(InputError, match="nothing is stored"):
        resolve("../pendulum", tmp_path / "nowhere")


def test_a_session_is_given_by_its_id_and_one_that_is_not_there_is_named(
    service, data_folder, write_measured_experiment
):
    write_measured_experiment(data_folder / "experiments" / "by-hand", seconds=0.5)
    store: ExperimentStore = service.service.experiments
    store.reindex()
    assert store.session("by-hand", "session-01").file == "session-01.csv"
    for experiment, session in (("by-hand", "session-09"), ("nowhere", "session-01")):
        with pytest.raises(Problem) as refused:
            store.session(experiment, session)
        assert refused.value.status == 404
        assert (session if experiment == "by-hand" else experiment) in str(refused.value)
