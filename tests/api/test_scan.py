"""`coulomb scan`: what it prints and how it refuses. On a bus: tests/vcan."""

import json
import subprocess
import sys

import pytest

from api.commands.scan import scan
from identify.recording.errors import InputError


def test_scan_of_an_empty_bus_says_so(capsys):
    scan(interface="virtual", channel="nobody", wait=0.05)
    assert capsys.readouterr().out == "no node answered on virtual channel nobody\n"


def test_scan_as_json_is_one_document(capsys):
    scan(interface="virtual", channel="nobody", wait=0.05, as_json=True)
    assert json.loads(capsys.readouterr().out) == {"interface": "virtual", "channel": "nobody", "nodes": []}


def test_a_wrong_channel_is_exit_status_2_and_one_line():
    arguments = ["scan", "--interface", "socketcan", "--channel", "can99", "--json"]
    result = subprocess.run([sys.executable, "-m", "api", *arguments], capture_output=True, text=True)
    assert (result.returncode, result.stdout) == (2, "")
    assert "CAN interface 'can99' is not there" in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"interface": "telepathy"}, "--interface telepathy .*'telepathy' is not known"),
        ({"wait": 0.0}, "--wait: must be above 0 s"),
        ({"bitrate": 0}, "--bitrate: must be above 0"),
    ],
)
def test_scan_refuses_wrong_arguments_by_name(arguments, words):
    with pytest.raises(InputError, match=words):
        scan(**({"interface": "virtual", "channel": "x"} | arguments))
