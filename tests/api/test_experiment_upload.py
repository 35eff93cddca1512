"""Uploads are parsed without trusting a byte of them, and leave nothing behind when refused."""

import gzip
import io
import zipfile
from concurrent.futures import ThreadPoolExecutor

import h5py
import numpy as np
import pytest

from api.service.accounts import Role
from identify.recording import load_experiment

YAML = """format: 1
name: uploaded
robot:
  gravity: [0.0, -9.81, 0.0]
  joints: [{name: j1, type: revolute, drive_gain: 10.0}]
payloads:
  - {name: none, mass: 0.0}
sessions:
  - {file: SESSION, payload: none}
"""
CSV = "t,q1,v1\n" + "".join(
    f"{0.01 * k:.2f},{np.sin(0.02 * k):.6f},{np.cos(0.02 * k):.6f}\n" for k in range(400)
)


def archive(**members):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as out:
        for name, content in members.items():
            out.writestr(name, content)
    return packed.getvalue()


@pytest.fixture
def operator(service):
    return service.client(Role.OPERATOR)


@pytest.fixture
def refused(operator, data_folder):
    """Uploads an archive that must be refused, and checks that nothing of it is left."""

    def upload(content, status=422):
        answer = operator.post("/experiments/import", files={"file": ("a.zip", content)})
        assert answer.status_code == status, answer.text
        assert list((data_folder / "experiments").iterdir()) == []
        assert operator.get("/experiments").json() == []
        assert "/" not in answer.json()["detail"].replace("experiment.yaml", "").replace("../", "")[:1]
        return answer.json()["detail"]

    return upload


def test_an_archive_with_everything_in_one_folder_is_stored(operator, service):
    content = archive(**{"my/experiment.yaml": YAML.replace("SESSION", "a.csv"), "my/a.csv": CSV})
    answer = operator.post("/experiments/import", files={"file": ("a.zip", content)})
    assert answer.status_code == 201, answer.text
    assert answer.headers["Location"] == "/experiments/uploaded"
    assert answer.json()["experiment"]["sessions"][0]["id"] == "a"
    assert (service.service.experiments.folder("uploaded") / "a.csv").read_text() == CSV


def test_two_experiments_of_one_name_get_two_ids(operator):
    content = archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": CSV})
    ids = [
        operator.post("/experiments/import", files={"file": ("a.zip", content)}).json()["experiment"]["id"]
        for _ in range(2)
    ]
    assert ids == ["uploaded", "uploaded-2"]


@pytest.mark.parametrize(
    "name", ["../../evil.csv", "/etc/evil.csv", "..\\evil.csv", "a/../../evil.csv", ".hidden.csv"]
)
def test_a_name_that_leads_elsewhere_is_refused(refused, name, tmp_path):
    detail = refused(archive(**{"experiment.yaml": YAML.replace("SESSION", "evil.csv"), name: CSV}))
    assert "file" in detail
    assert not list(tmp_path.rglob("*evil*"))


def test_a_program_in_the_archive_is_not_stored(operator, service):
    content = archive(
        **{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": CSV, "run.py": "print(1)"}
    )
    answer = operator.post("/experiments/import", files={"file": ("a.zip", content)})
    assert answer.json()["passed_over"] == ["run.py"]
    stored = {path.name for path in service.service.experiments.folder("uploaded").iterdir()}
    assert "run.py" not in stored


def test_a_session_that_names_a_file_outside_the_upload_is_refused(refused, tmp_path):
    (tmp_path / "data" / "secret.csv").write_text(CSV)
    detail = refused(archive(**{"experiment.yaml": YAML.replace("SESSION", "../../secret.csv")}))
    assert "secret.csv" in detail


def test_a_symbolic_link_in_the_archive_is_only_a_text(refused):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as out:
        out.writestr("experiment.yaml", YAML.replace("SESSION", "a.csv"))
        link = zipfile.ZipInfo("a.csv")
        link.external_attr = 0o120777 << 16
        out.writestr(link, "/etc/passwd")
    assert "a.csv" in refused(packed.getvalue())


def test_an_archive_that_unpacks_to_more_than_accepted_is_refused_while_unpacking(start_service):
    service = start_service(unpacked_limit=1_000_000)
    bomb = archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": "0" * 50_000_000})
    assert len(bomb) < 100_000
    answer = service.client(Role.OPERATOR).post("/experiments/import", files={"file": ("a.zip", bomb)})
    assert answer.status_code == 413


def test_a_session_that_decompresses_to_more_than_accepted_is_refused(start_service):
    service = start_service(unpacked_limit=1_000_000)
    bomb = gzip.compress(b"t,q1,v1\n" + b"0,0,0\n" * 5_000_000)
    content = archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv.gz"), "a.csv.gz": bomb})
    assert len(bomb) < 1_000_000
    answer = service.client(Role.OPERATOR).post("/experiments/import", files={"file": ("a.zip", content)})
    assert answer.status_code == 413


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"no archive", "not a zip archive"),
        (archive(**{"a.csv": CSV}), "holds no experiment.yaml"),
        (archive(**{"experiment.yaml": "a: [", "a.csv": CSV}), "experiment.yaml"),
        (archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": "t,q1\n0,0\n"}), "a.csv"),
        (
            archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv.gz"), "a.csv.gz": b"no gzip"}),
            "a.csv.gz",
        ),
        (archive(**{"experiment.yaml": YAML.replace("SESSION", "a.h5"), "a.h5": b"no hdf5"}), "a.h5"),
        (
            archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": CSV})[:-40],
            "not a zip archive",
        ),
    ],
)
def test_what_cannot_be_read_is_refused_with_the_file_that_is_wrong(refused, content, words, data_folder):
    detail = refused(content)
    assert words in detail
    assert str(data_folder) not in detail


def recording(tmp_path, change):
    path = tmp_path / "upload.h5"
    with h5py.File(path, "w") as file:
        rows = 500
        file["cycle"] = np.arange(rows)
        file["sync_time"] = np.arange(rows) * 2_000_000
        for name in ("position", "command", "setpoint"):
            file[name] = np.zeros((rows, 1), np.int32)
        file["valid"] = np.full((rows, 1), 3, np.uint8)
        change(file, tmp_path)
    return path.read_bytes()


def external_storage(file, tmp_path):
    (tmp_path / "secret").write_bytes(b"x" * 2000)
    del file["position"]
    file.create_dataset("position", (500, 1), np.int32, external=[(str(tmp_path / "secret"), 0, 2000)])


def external_link(file, tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["position"] = np.zeros((500, 1), np.int32)
    del file["position"]
    file["position"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/position")


def virtual_data(file, tmp_path):
    layout = h5py.VirtualLayout((500, 1), np.int32)
    layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "position", (500, 1))
    del file["position"]
    file.create_virtual_dataset("position", layout)


def huge_data(file, _tmp_path):
    del file["command"]
    file.create_dataset("command", (2**40, 1), np.int32, chunks=(1024, 1), compression="gzip")


@pytest.mark.parametrize(
    ("change", "status"),
    [(external_storage, 422), (external_link, 422), (virtual_data, 422), (huge_data, 413)],
)
def test_a_recording_that_points_out_of_itself_or_claims_too_much_is_refused(
    refused, tmp_path, change, status
):
    content = recording(tmp_path, change)
    detail = refused(archive(**{"experiment.yaml": YAML.replace("SESSION", "a.h5"), "a.h5": content}), status)
    assert "a.h5" in detail


def test_a_session_for_another_robot_or_of_an_unknown_payload_is_refused_and_changes_nothing(
    operator, service
):
    content = archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": CSV})
    operator.post("/experiments/import", files={"file": ("a.zip", content)})
    folder = service.service.experiments.folder("uploaded")
    before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    attempts = [
        ("b.csv", CSV, {"payload": "disk"}, 422, "disk"),
        ("b.csv", "t,q1,q2,v1,v2\n0,0,0,0,0\n", {"payload": "none"}, 422, "b.csv line 1"),
        ("b.exe", CSV, {"payload": "none"}, 422, ".csv"),
        ("b.csv", CSV, {"payload": "none", "mass": "3"}, 409, "0.0 kg"),
        ("b.csv", CSV, {"payload": "none", "mass": "-3"}, 422, "mass"),
        ("b.csv", CSV, {"payload": "none", "role": "chief"}, 422, "role"),
    ]
    for name, text, fields, status, words in attempts:
        answer = operator.post(
            "/experiments/uploaded/sessions/import", files={"file": (name, text)}, data=fields
        )
        assert answer.status_code == status, answer.text
        assert words in answer.json()["detail"]
    assert {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252", "utf-16"])
def test_a_table_of_another_dialect_becomes_a_session_by_the_contract(operator, service, encoding):
    content = archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": CSV})
    operator.post("/experiments/import", files={"file": ("a.zip", content)})
    rows = CSV.replace(",", ";").replace(".", ",").splitlines()
    table = "\r\n".join(["Messung Prüfstand", "t;q1 [deg];v1 [mA]", *rows[1:]])
    answer = operator.post(
        "/experiments/uploaded/sessions/import",
        files={"file": ("b.csv", table.encode(encoding))},
        data={"payload": "none"},
    )
    assert answer.status_code == 201, answer.text
    experiment = load_experiment(service.service.experiments.folder("uploaded"))
    first, second = (experiment.read(entry) for entry in experiment.sessions)
    np.testing.assert_allclose(second.position, np.deg2rad(first.position), atol=1e-12)
    np.testing.assert_allclose(second.command, first.command / 1000, atol=1e-12)


def test_a_session_with_a_new_payload_adds_the_payload(operator):
    content = archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": CSV})
    operator.post("/experiments/import", files={"file": ("a.zip", content)})
    answer = operator.post(
        "/experiments/uploaded/sessions/import",
        files={"file": ("b.csv", CSV)},
        data={"payload": "brick", "mass": "2.5"},
    )
    assert answer.status_code == 201, answer.text
    experiment = operator.get("/experiments/uploaded").json()
    assert [payload["name"] for payload in experiment["payloads"]] == ["none", "brick"]
    assert [session["id"] for session in experiment["sessions"]] == ["a", "session-00"]


@pytest.mark.parametrize("identifier", ["%2e%2e", "..%2f..%2fetc", "a%00b", "~", "ABC", "x" * 65])
def test_an_id_that_is_no_id_reaches_no_file(operator, identifier):
    for address in (
        f"/experiments/{identifier}",
        f"/plans/{identifier}",
        f"/experiments/{identifier}/results",
    ):
        assert operator.get(address).status_code in (400, 404, 422)


def test_sessions_that_are_added_at_the_same_time_are_all_there_under_names_of_their_own(operator, service):
    content = archive(**{"experiment.yaml": YAML.replace("SESSION", "a.csv"), "a.csv": CSV})
    operator.post("/experiments/import", files={"file": ("a.zip", content)})
    clients = [service.client(Role.OPERATOR, f"user{number}") for number in range(6)]

    def add(client):
        return client.post(
            "/experiments/uploaded/sessions/import", files={"file": ("b.csv", CSV)}, data={"payload": "none"}
        ).status_code

    with ThreadPoolExecutor(6) as adding:
        assert list(adding.map(add, clients)) == [201] * 6
    experiment = load_experiment(service.service.experiments.folder("uploaded"))
    assert sorted(entry.file for entry in experiment.sessions) == [
        "a.csv",
        *(f"session-{number:02d}.csv" for number in range(6)),
    ]
    assert {len(experiment.read(entry).time) for entry in experiment.sessions} == {400}


def test_an_effect_outside_the_upload_is_refused(refused):
    yaml = YAML.replace("SESSION", "a.csv") + "effects: [/etc/e.yaml]\n"
    assert "/etc/e.yaml" in refused(archive(**{"experiment.yaml": yaml, "a.csv": CSV, "e.yaml": "name: e"}))
