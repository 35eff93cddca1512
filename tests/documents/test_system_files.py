"""The unit and the settings that docs/install.md puts to use are taken by the programs that they are for."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SYSTEM = ROOT / "config" / "system"
GUIDE = (ROOT / "docs" / "install.md").read_text()


@pytest.fixture
def unit(tmp_path):
    """The unit with a program that is on this machine."""
    path = tmp_path / "coulomb.service"
    text = (SYSTEM / "coulomb.service").read_text()
    path.write_text(text.replace("/opt/coulomb/.venv/bin/coulomb", shutil.which("true") or "/bin/true"))
    return path


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze on this machine")
def test_systemd_takes_the_unit_and_finds_little_exposed(unit):
    verified = subprocess.run(
        ["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False
    )
    assert (verified.returncode, verified.stderr) == (0, "")
    judged = subprocess.run(
        ["systemd-analyze", "security", "--offline=yes", "--no-pager", unit],
        capture_output=True,
        text=True,
        check=False,
    ).stdout
    exposure = re.search(r"exposure level for coulomb.service: ([\d.]+)", judged)
    assert exposure is not None, judged
    assert float(exposure[1]) < 3


def test_the_unit_is_never_restarted_into_a_motion_and_lets_the_acquisition_have_what_it_asks_for(unit):
    settings = dict(re.findall(r"^(\w+)=(.*)$", unit.read_text(), re.MULTILINE))
    assert settings["Restart"] == "no"
    assert settings["KillMode"] == "control-group"
    assert int(settings["LimitRTPRIO"]) >= 50
    assert settings["LimitMEMLOCK"] == "infinity"
    assert int(settings["LimitNOFILE"]) >= 8192
    assert settings["User"] == "coulomb"
    assert "AF_CAN" in settings["RestrictAddressFamilies"]
    assert "RestrictRealtime" not in settings
    assert "PrivateNetwork" not in settings


def settings_of(name: str) -> dict[str, str]:
    return dict(re.findall(r"^(\w+)=(.*)$", (SYSTEM / name).read_text(), re.MULTILINE))


def test_what_left_the_interface_down_or_held_up_the_start_in_a_lab_is_not_asked_for():
    """Seen with systemd 252 and Linux 6.1: each of them failed there."""
    assert "RestartSec" not in settings_of("80-can.network")  # refused by drivers that cannot restart
    assert not re.match(r"v?x?can\d+$", settings_of("70-can.link")["Name"])  # may be taken by another adapter
    assert (
        "network-online" not in settings_of("coulomb.service")["After"]
    )  # two minutes where nothing has an address


def test_the_guide_names_every_file_and_every_option_that_it_uses_is_one():
    for file in SYSTEM.iterdir():
        assert f"config/system/{file.name}" in GUIDE, file.name
    from api.commands.serve import serve

    known = {f"--{name.replace('_', '-')}" for name in serve.__annotations__}
    used = set(re.findall(r"coulomb serve[^\n`]*", GUIDE))
    options = {option for line in used for option in re.findall(r"--[a-z-]+", line)}
    assert options <= known, options - known
