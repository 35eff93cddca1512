"""A data folder in one file, and the same folder made of it: same experiments, same results, same people."""

import io
import json
import os
import tarfile
import threading

import pytest
from typer.testing import CliRunner

import identify
from api.command_line import _register_commands, application
from api.service.accounts import LOCAL_OPERATOR, Role
from api.service.backup import MANIFEST, restore_backup, write_backup
from api.service.open_data import open_data
from identify.recording import InputError, load_experiment


@pytest.fixture
def stocked(service, imported, data_folder):
    """A running service with an identified experiment, a plan, a rig of its own and an account; its data folder."""
    (data_folder / "rigs").mkdir(exist_ok=True)
    (data_folder / "rigs" / "bench.yaml").write_text("name: bench")
    (data_folder / "plans" / "reports").mkdir(parents=True, exist_ok=True)
    (data_folder / "plans" / "slow.json").write_text("{}")
    (data_folder / "experiments" / ".incoming-x").mkdir()
    (data_folder / "experiments" / ".incoming-x" / "half.csv").write_text("t")
    return data_folder


def files_of(folder):
    """Without what is on its way, and without figures, which the service makes beside the test."""
    return {
        str(path.relative_to(folder)): (path.read_bytes(), path.stat().st_mtime_ns)
        for kind in ("experiments", "rigs", "plans")
        for path in (folder / kind).rglob("*")
        if path.is_file() and ".incoming" not in str(path) and "shown" not in path.parts
    }


@pytest.mark.parametrize("name", ["all.tar", "all.tar.gz"])
def test_a_restored_folder_is_the_same_and_gives_the_same_results(
    stocked, imported, start_service, tmp_path, name
):
    before, identifier = imported
    archive, restored = tmp_path / name, tmp_path / "restored"
    assert write_backup(stocked, archive).database
    assert archive.stat().st_mode & 0o077 == 0
    report = restore_backup(archive, restored)
    assert report.files > 5
    assert files_of(restored) == files_of(stocked)
    assert not list((restored / "experiments").glob(".*"))
    documents = [
        identify.identify(load_experiment(folder / "experiments" / identifier)).document().to_json()
        for folder in (stocked, restored)
    ]
    assert documents[0] == documents[1]
    with open_data(restored, None) as opened:
        assert opened.experiments.reindex() == 1
        assert (
            opened.accounts.check_password("the-operator", "correct horse battery").user.role == Role.OPERATOR
        )
        assert opened.audit.check().ok
    from api.application import create_application
    from api.service.settings import ServiceSettings

    again = create_application(ServiceSettings(data_folder=restored)).state.service
    found = again.models.results(identifier)
    assert found.stale is False
    assert found.identification.to_json() == {
        key: value
        for key, value in before.get(f"/experiments/{identifier}/results").json().items()
        if key not in ("version", "stale", "job", "diagnosis")
    }
    again.database.close()


def test_a_backup_of_a_service_that_is_being_used_is_whole(stocked, service, tmp_path):
    ended, written = threading.Event(), []

    def use():
        while not ended.is_set():
            service.service.audit.append(LOCAL_OPERATOR, "action", "target", "done")
            written.append(1)

    using = threading.Thread(target=use)
    using.start()
    try:
        while len(written) < 3:
            pass
        write_backup(stocked, tmp_path / "all.tar")
    finally:
        ended.set()
        using.join()
    restore_backup(tmp_path / "all.tar", tmp_path / "restored")
    with open_data(tmp_path / "restored", None) as opened:
        found = opened.audit.check()
    assert found.ok
    assert found.rows >= 3


def test_a_restore_touches_nothing_that_is_there(stocked, tmp_path):
    write_backup(stocked, tmp_path / "all.tar")
    before = files_of(stocked)
    with pytest.raises(InputError, match="is not empty"):
        restore_backup(tmp_path / "all.tar", stocked)
    assert files_of(stocked) == before


@pytest.mark.parametrize("damage", ["cut", "byte", "none of ours", "foreign member", "manifest"])
def test_a_damaged_backup_is_refused_and_leaves_nothing(stocked, tmp_path, damage):
    archive = tmp_path / "all.tar"
    write_backup(stocked, archive)
    content = archive.read_bytes()
    if damage == "cut":
        archive.write_bytes(content[: len(content) // 2])
    elif damage == "byte":
        place = content.index(b"t,q1,v1") + 500
        archive.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
    elif damage == "none of ours":
        archive.write_bytes(b"no archive")
    else:
        manifest = damage == "manifest"
        with tarfile.open(archive, "w") as tar:
            info = tarfile.TarInfo(MANIFEST if manifest else "experiments/../../evil")
            text = b'{"format": 9, "files": []}' if manifest else b"x"
            info.size = len(text)
            tar.addfile(info, io.BytesIO(text))
    with pytest.raises(InputError, match=str(archive)) as refused:
        restore_backup(archive, tmp_path / "restored")
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "restored").exists()
    assert not list(tmp_path.glob(".restored*"))
    assert not list(tmp_path.rglob("evil"))


def test_a_backup_that_cannot_be_written_leaves_no_half_archive(stocked, tmp_path):
    (tmp_path / "full").mkdir()
    os.chmod(tmp_path / "full", 0o755)
    with pytest.raises(InputError, match="cannot be written"):
        write_backup(stocked, tmp_path / "missing" / "all.tar")
    with pytest.raises(InputError, match="not a data folder"):
        write_backup(tmp_path / "full", tmp_path / "all.tar")
    assert not list(tmp_path.glob("all.tar*"))


def test_the_commands_copy_and_restore(stocked, tmp_path):
    _register_commands("")
    run = CliRunner().invoke
    archive, restored = str(tmp_path / "all.tar.gz"), str(tmp_path / "restored")
    written = run(application, ["backup", archive, "--data", str(stocked), "--json"])
    assert written.exit_code == 0, written.output
    made = run(application, ["restore", archive, "--data", restored, "--json"])
    assert made.exit_code == 0, made.output
    assert json.loads(made.stdout)["experiments"] == 1
    assert json.loads(made.stdout)["files"] == json.loads(written.stdout)["files"]
