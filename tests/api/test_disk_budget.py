"""The disk is warned of before it binds, in the log and on every page, and what would fill it is refused."""

import logging

import pytest

from api.service.accounts import Role
from api.service.disk_budget import RESERVE, WARN_BELOW, DiskBudget
from api.service.problems import Problem

PLENTY = 10**12


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "experiments").mkdir()
    (tmp_path / "experiments" / "a.h5").write_bytes(bytes(700_000))
    return tmp_path


def test_a_budget_that_gets_used_up_is_warned_of_once_and_binds(folder, caplog):
    caplog.set_level(logging.WARNING)
    disk = DiskBudget(folder, 1_000_000, lambda folder: PLENTY)
    assert (disk.state.used, disk.state.warning, disk.state.full) == (700_000, None, False)
    disk.require_room()
    (folder / "experiments" / "b.h5").write_bytes(bytes(200_000))
    for _ in range(3):
        disk.look()
    assert "0.0009 of 0.001 GB" in disk.state.warning
    assert [record.message for record in caplog.records] == [f"disk: {disk.state.warning}"]
    disk.require_room()
    with pytest.raises(Problem, match="no room") as refused:
        disk.require_room(coming=200_000)
    assert refused.value.status == 507
    (folder / "experiments" / "c.h5").write_bytes(bytes(200_000))
    disk.look()
    assert "moved away" in disk.state.warning
    assert len(caplog.records) == 2
    for name in "abc":
        (folder / "experiments" / f"{name}.h5").unlink()
    assert disk.look().warning is None
    disk.require_room()


@pytest.mark.parametrize(
    ("free", "tight", "full"),
    [(2 * WARN_BELOW, False, False), (WARN_BELOW / 2, True, False), (RESERVE / 2, True, True)],
)
def test_without_a_budget_the_disk_itself_binds(folder, free, tight, full):
    disk = DiskBudget(folder, None, lambda folder: int(free))
    assert (disk.state.warning is not None, disk.state.full) == (tight, full)


@pytest.mark.parametrize(("coming", "room"), [(0, True), (250_000, True), (300_000, False), (400_000, False)])
def test_what_is_coming_must_fit_into_the_budget_with_what_is_there(folder, coming, room):
    refused_without_room(DiskBudget(folder, 1_000_000, lambda folder: PLENTY), coming, room)


@pytest.mark.parametrize(("coming", "room"), [(0, True), (1_000_000, True), (1_000_001, False)])
def test_what_is_coming_leaves_the_disk_its_reserve(folder, coming, room):
    refused_without_room(DiskBudget(folder, None, lambda folder: RESERVE + 1_000_000), coming, room)


def refused_without_room(disk, coming, room):
    if room:
        disk.require_room(coming)
        return
    with pytest.raises(Problem, match="There is no room: ") as refused:
        disk.require_room(coming)
    assert refused.value.status == 507


def test_every_page_says_it_and_uploads_and_sessions_are_refused(start_service, data_folder):
    service = start_service(disk_budget=1)
    operator = service.client(Role.OPERATOR)
    page = operator.get("/pages/experiments", headers={"Accept": "text/html"}).text
    assert "data-disk-warning" in page
    assert "moved away" in page
    refused = operator.post("/experiments/import", files={"file": ("a.zip", b"x")})
    assert refused.status_code == 507
    rig = "rx130l-joint3-simulated"
    operator.post("/experiments", json={"name": "arm", "rig": rig})
    session = {"rig": rig, "plan": "slow", "payload": {"name": "none"}}
    assert operator.post("/experiments/arm/sessions", json=session).status_code == 507
    assert operator.get("/experiments/arm").status_code == 200


def test_no_page_says_anything_while_there_is_room(service):
    service.service.disk._free = lambda folder: PLENTY
    service.service.disk.look()
    assert "data-disk-warning" not in service.client(Role.OPERATOR).get("/pages/experiments").text
