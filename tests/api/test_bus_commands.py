"""`coulomb scan` and `coulomb fake-drive`: what they print and how they refuse. On a bus: tests/vcan."""

import json
import subprocess
import sys

import pytest


def coulomb(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "api", *arguments], capture_output=True, text=True)


def test_scan_of_an_empty_bus_says_so():
    result = coulomb("scan", "--interface", "virtual", "--channel", "nobody", "--wait", "0.05")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout == "no node answered on virtual channel nobody\n"


def test_scan_as_json_is_one_document():
    result = coulomb("scan", "--interface", "virtual", "--channel", "nobody", "--wait", "0.05", "--json")
    assert json.loads(result.stdout) == {"interface": "virtual", "channel": "nobody", "nodes": []}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("scan", "--interface", "socketcan", "--channel", "can99"), "'can99' is not there"),
        (("scan", "--interface", "telepathy", "--channel", "x"), "'telepathy' is not known"),
        (("scan", "--interface", "virtual", "--channel", "x", "--wait", "0"), "--wait: must be above 0 s"),
        (
            ("scan", "--interface", "virtual", "--channel", "x", "--bitrate", "0"),
            "--bitrate: must be above 0",
        ),
        (("fake-drive", "no-such-rig"), "no-such-rig"),
        (("fake-drive", "rx130l-joint3-simulated"), "--interface: a virtual bus ends with this process"),
        (
            ("fake-drive", "rx130l-joint3-simulated", "--interface", "socketcan", "--channel", "can99"),
            "--channel can99: CAN interface 'can99' is not there",
        ),
        (
            ("fake-drive", "rx130l-joint3-simulated", "--interface", "socketcan", "--payload", "anvil"),
            "payload 'anvil' is not known",
        ),
        (
            ("fake-drive", "rx130l-joint3-simulated", "--interface", "socketcan", "--seconds", "-1"),
            "--seconds: must be above 0",
        ),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(arguments, words):
    result = coulomb(*arguments)
    assert result.returncode == 2
    assert words in result.stderr
    assert result.stderr.count("\n") == 1
    assert result.stdout == ""
