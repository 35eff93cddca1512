"""Tables of drives by REST and on the pages: shown, written and read back, taken back; refused in one line."""

import re

import pytest
import yaml

import api.service.drive_table_writings as writings
import api.service.drive_work as drive_work
from api.client import Client, ServiceError
from api.drive_tables import tables_before
from api.service.accounts import Role, User
from api.service.problems import Problem
from daq.rig import RIGS
from daq.simulated_rig import simulated_rig
from drivers.errors import DriverError
from tests.api.driven_arm import write_driven_arm

BENCH = "bench"
DRIVES = RIGS.parent / "drives"
LAST = re.compile("Last written from here: <strong>([^<]*)</strong>")
REFUSED = (
    r"Rig bench, drive of j3: own\.yaml or .*\.eds changed since the tables were computed; compute them again"
)


@pytest.fixture
def bench(service, finished, monkeypatch):
    """An operator's client, an identified experiment, and a rig whose simulated drives are there all the time."""
    held = service.service
    settings = yaml.safe_load((RIGS / "rx130l-joint3-simulated.yaml").read_text())
    settings |= {"name": BENCH, "bus": {"interface": "virtual", "channel": "tables-of-the-bench"}}
    folder = held.settings.data_folder / "rigs"
    folder.mkdir(exist_ok=True)
    (folder / f"{BENCH}.yaml").write_text(yaml.safe_dump(settings))
    real = drive_work.require_lasting_drives
    monkeypatch.setattr(
        drive_work, "require_lasting_drives", lambda rig: None if rig.name == BENCH else real(rig)
    )
    rig = held.rigs.rig(BENCH)
    with held.experiments.incoming() as incoming:
        write_driven_arm(incoming, rig)
        held.experiments.adopt(incoming, "arm")
    http = service.client(Role.OPERATOR)
    fit = http.post("/experiments/arm/models", json={"model": "usual", "add": []}).json()
    assert finished(http, fit)["state"] == "done"
    with simulated_rig(rig, rig.payload("none")) as on:
        yield http, on.nodes[0].drive.compensation, folder / f"{BENCH}.yaml", rig


def held_by(compensation):
    return {index: list(values) for index, values in compensation.raw.items()}


def refused_before_there_are_tables(client, http):
    for call in (client.drive_tables, client.write_drive_tables):
        with pytest.raises(ServiceError, match="were not computed yet"):
            call("arm", BENCH)
    for rig, model, words in (("no-rig", None, "no-rig"), (BENCH, "m9", "m9")):
        for call in (client.compute_drive_tables, client.drive_tables, client.write_drive_tables):
            with pytest.raises(ServiceError, match=words):
                call("arm", rig, model)
    assert http.post("/experiments/arm/drive-tables/writings", json={"model": "m1"}).status_code == 422
    with pytest.raises(ServiceError, match="00"):
        client.write_drive_tables_back("arm", "00")


def test_tables_are_computed_shown_written_and_taken_back(bench, service, finished):
    http, compensation, _, _ = bench
    client = Client("", http=http)
    refused_before_there_are_tables(client, http)
    job = finished(http, client.compute_drive_tables("arm", BENCH))
    assert job["result"] == {"model": "m1", "rig": BENCH}, job
    shown = client.drive_tables("arm", BENCH)
    (table,) = shown.joints[0].tables
    assert not shown.written
    before = held_by(compensation)
    # the curve of the model is what the table is to hold: viscous and dry friction, of either direction
    assert {row[0] > 0.0 for row in table.model} == {True, False}
    viewer = service.client(Role.VIEWER)
    address = "/pages/experiments/arm/drive-tables"
    page = viewer.get(address, params={"rig": BENCH}).text
    assert "0x2021:01 to 08" in page
    assert "Write and read back" not in page
    assert "hx-confirm" in http.get(address, params={"rig": BENCH}).text
    for method, where in (("post", "writings"), ("post", "writings/00/back")):
        refused = getattr(viewer, method)(f"/experiments/arm/drive-tables/{where}", json={"rig": BENCH})
        assert refused.status_code == 403
    assert client.drive_table_writings("arm") == []
    assert held_by(compensation) == before

    writing = client.write_drive_tables("arm", BENCH)
    assert (writing.number, writing.state, writing.version) == ("00", "written", "m1")
    assert compensation.raw[0x2021][0] == table.objects[8].value != 0
    assert service.service.operators.operator(BENCH) == "the-operator"
    assert any(
        row.action == "drive tables" and "model m1" in row.target for row in service.service.audit.rows()
    )
    assert LAST.findall(http.get(address, params={"rig": BENCH}).text) == ["model m1"]
    back = client.write_drive_tables_back("arm", "00")
    assert (back.undoes, back.state) == ("00", "written")
    assert held_by(compensation) == before
    assert [each.number for each in client.drive_table_writings("arm")] == ["01", "00"]
    assert LAST.findall(http.get(address, params={"rig": BENCH}).text) == ["what was before 00"]
    refuses_what_cannot_be_written_to(client, http, finished)
    # another operator does not write to drives of a rig that somebody has
    other = service.client(Role.OPERATOR, "grace")
    assert other.post("/experiments/arm/drive-tables/writings", json={"rig": BENCH}).status_code == 409


def test_why_no_tables_were_computed_stays_on_the_page_until_they_are(bench, service, finished):
    http, _, _, _ = bench
    client = Client("", http=http)
    record = min(service.service.experiments.folder("arm").glob("session-*.*"))
    kept = record.read_bytes()
    record.write_bytes(b"this is no recording")
    failed = finished(http, client.compute_drive_tables("arm", BENCH))
    assert failed["state"] == "failed"
    assert failed["result"] == {"model": "m1", "rig": BENCH}

    def shown() -> str:
        return http.get("/pages/experiments/arm/drive-tables", params={"rig": BENCH}).text

    for _ in range(2):
        assert (
            f"data-tables-fault>The last time no tables were computed: experiments/arm/{record.name}"
            in shown()
        )
    record.write_bytes(kept)
    assert finished(http, client.compute_drive_tables("arm", BENCH))["state"] == "done"
    assert "data-tables-fault" not in shown()


def test_a_changed_rig_file_and_a_refusing_drive_leave_everything_as_it_was(
    bench, service, finished, monkeypatch
):
    http, compensation, file, _ = bench
    client = Client("", http=http)
    finished(http, client.compute_drive_tables("arm", BENCH))
    before = held_by(compensation)

    real = writings.written

    def client_tables():
        return service.service.drive_tables.writings("arm")[0].tables

    def refuses(tables, rig, about_to_write):
        real(tables, rig, about_to_write)
        real(tables_before(client_tables(), rig), rig)
        raise DriverError("node 3: 0x2022:08 refused")

    with monkeypatch.context() as patched:
        patched.setattr(writings, "written", refuses)
        with pytest.raises(ServiceError, match="0x2022:08 refused"):
            client.write_drive_tables("arm", BENCH)
    (writing,) = client.drive_table_writings("arm")
    assert (writing.state, writing.reason) == ("refused", "node 3: 0x2022:08 refused")
    held = [each.before for table in writing.tables.joints[0].tables for each in table.objects]
    assert held == [0.0] * len(held)

    class Killed(BaseException):
        """What ends a service without a word."""

    def dies(tables, rig, about_to_write):
        real(tables, rig, about_to_write)
        raise Killed

    monkeypatch.setattr(writings, "written", dies)
    assert held_by(compensation) == before
    with pytest.raises(Killed):
        service.service.drive_tables.write("arm", User("the-operator", Role.OPERATOR, "token"), BENCH)
    monkeypatch.setattr(writings, "written", real)
    assert client.drive_table_writings("arm")[0].state == "begun"
    page = http.get("/pages/experiments/arm/drive-tables").text
    assert "the drives may hold some of both" in page
    # what they held before is on disk, and given back
    assert held_by(compensation) != before
    client.write_drive_tables_back("arm", "01")
    assert held_by(compensation) == before

    file.write_text(file.read_text().replace("cycle: 0.002", "cycle: 0.004"))
    with pytest.raises(ServiceError, match="cycle changed since the tables were computed"):
        client.write_drive_tables("arm", BENCH)
    assert held_by(compensation) == before


def test_tables_of_a_drive_whose_profile_says_something_else_by_now_are_not_written_and_what_was_before_is(
    bench, service, finished
):
    """Amperes instead of milliamperes for a count, say: each value would be another current."""
    http, compensation, file, _ = bench
    client = Client("", http=http)
    rig_text = yaml.safe_load(file.read_text())
    profile = file.with_name("own.yaml")
    name = rig_text["axes"][0]["drive"]
    profile.write_text((DRIVES / f"{name}.yaml").read_text())
    rig_text["axes"][0]["drive"] = str(profile)
    file.write_text(yaml.safe_dump(rig_text))
    before = held_by(compensation)
    assert finished(http, client.compute_drive_tables("arm", BENCH))["state"] == "done"
    client.write_drive_tables("arm", BENCH)
    written = held_by(compensation)

    def shown() -> str:
        return http.get("/pages/experiments/arm/drive-tables", params={"rig": BENCH}).text

    profile.write_text("# only a remark\n" + profile.read_text())
    assert "Write and read back" in shown()
    content = yaml.safe_load(profile.read_text())
    content["current_reference"]["sign"] = -content["current_reference"].get("sign", 1)
    profile.write_text(yaml.safe_dump(content))
    for refused in (
        lambda: client.write_drive_tables("arm", BENCH),
        lambda: service.service.drive_tables.write("arm", User("ada", Role.OPERATOR, "token"), BENCH),
    ):
        with pytest.raises((ServiceError, Problem), match=REFUSED):
            refused()
    page = shown()
    assert re.search(REFUSED, page)
    assert "Write and read back" not in page
    assert held_by(compensation) == written
    assert len(client.drive_table_writings("arm")) == 1
    # counts that were read from the drive mean to it what they meant
    assert client.write_drive_tables_back("arm", "00").state == "written"
    assert held_by(compensation) == before
    assert finished(http, client.compute_drive_tables("arm", BENCH))["state"] == "done"
    assert "Write and read back" in shown()
    profile.write_text("name: nonsense\n")
    assert http.get("/pages/experiments/arm/drive-tables", params={"rig": BENCH}).status_code < 500


def refuses_what_cannot_be_written_to(client, http, finished):
    rig = "rx130l-joint3-simulated"
    assert finished(http, client.compute_drive_tables("arm", rig))["state"] == "done"
    with pytest.raises(ServiceError, match="live only as long as a session"):
        client.write_drive_tables("arm", rig)
    page = http.get("/pages/experiments/arm/drive-tables", params={"rig": rig}).text
    assert "live only as long as a session" in page
    assert "Write and read back" not in page
    other = finished(http, client.compute_drive_tables("arm", "tx40-simulated"))
    assert (other["state"], "joints" in other["words"] or "robot" in other["words"]) == ("failed", True)
