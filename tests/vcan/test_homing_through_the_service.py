"""A joint of a rig on the kernel's CAN is homed, started and stopped through the service."""

import contextlib
import time
import warnings

import pytest
import yaml

from api.application import create_application
from api.service.accounts import Role
from api.service.settings import ServiceSettings
from daq.rig import Rig
from daq.rig_check import check_rig
from daq.rig_drives import RigDrives
from drivers.cia402 import State

with warnings.catch_warnings():
    # Starlette's test client says that another HTTP library will follow; ours is the one in the lock.
    warnings.simplefilter("ignore")
    from fastapi.testclient import TestClient

PATIENCE = 60.0
HOME = "/rigs/arm/homing"


@pytest.fixture
def rig(fake_drive, tmp_path) -> Rig:
    """The fake drive's rig, its drive homed by itself, in the data folder of a service."""
    from tests.vcan.conftest import RIG

    settings = yaml.safe_load(RIG)
    settings["axes"][0]["homing"] = "drive"
    path = tmp_path / "data" / "rigs" / "arm.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump(settings), encoding="utf-8")
    return Rig.load(path)


@pytest.fixture
def clients(rig, tmp_path):
    """Clients of a viewer and an operator of that service."""
    application = create_application(ServiceSettings(data_folder=tmp_path / "data"))
    with TestClient(application, base_url="http://localhost:8000") as lifetime:

        def client(role: Role) -> TestClient:
            own = TestClient(application, base_url="http://localhost:8000")
            own.portal = lifetime.portal
            accounts = application.state.service.accounts
            accounts.add_user(f"the-{role}", "correct horse battery", role)
            token = accounts.issue_token(f"the-{role}", "test", role, 86400.0)
            own.headers["Authorization"] = f"Bearer {token.secret}"
            return own

        yield client(Role.ADMIN), client(Role.VIEWER), client(Role.OPERATOR)


def ended(client) -> dict:
    """The homing once it has ended."""
    latest = time.monotonic() + PATIENCE
    while (run := client.get(HOME).json())["state"] == "homing":
        assert time.monotonic() < latest, run
    return run


def test_a_joint_is_homed_and_passes_its_check(clients, rig):
    admin, viewer, operator = clients
    assert viewer.get(HOME).json() is None
    started = operator.post(HOME, json={"joint": "j1", "method": 37, "reset_faults": True})
    assert started.status_code == 202, started.text
    run = ended(viewer)
    assert (run["state"], run["joint"], run["operator"]) == ("done", "j1", "the-operator"), run
    assert run["within_limits"] is True
    with contextlib.closing(RigDrives(rig)) as drives:
        assert check_rig(drives).problems == ""
    asked = [row for row in admin.get("/audit").json() if row["action"] == "homing start"]
    assert asked[0]["target"] == "rig arm, joint j1"


def test_anybody_stops_it_and_nothing_else_takes_the_bus_meanwhile(clients, rig):
    _, viewer, operator = clients
    assert operator.post(HOME, json={"joint": "j1", "method": 34}).status_code == 202
    second = operator.post(HOME, json={"joint": "j1", "method": 34})
    assert second.status_code == 409
    assert "is being homed" in second.json()["detail"]
    assert viewer.get("/pages/run-state").json()["title"] == "j1 is being homed"
    assert operator.post("/rigs/arm/release").status_code == 409
    assert viewer.post("/rigs/arm/stop").json() == {"stopped": True}
    run = ended(viewer)
    assert (run["state"], run["words"]) == ("stopped", "stopped by the-viewer")
    with contextlib.closing(RigDrives(rig)) as drives:
        assert drives.drives[0].state() is State.SWITCH_ON_DISABLED
    assert viewer.post("/rigs/arm/stop").json() == {"stopped": False}


def test_the_rigs_page_has_a_button_for_who_may_press_it(clients):
    _, viewer, operator = clients
    page = "/pages/rig/state?rig=arm"
    assert "Home j1" in operator.get(page).text
    assert "Home j1" not in viewer.get(page).text
    pressed = operator.post("/pages/rig/home", data={"rig": "arm", "joint": "j1"})
    assert pressed.status_code == 200, pressed.text
    assert "j1 is being homed" in pressed.text or "homed; is at" in pressed.text
    assert ended(viewer)["state"] == "done"
    assert "homed; is at" in operator.get(page).text
