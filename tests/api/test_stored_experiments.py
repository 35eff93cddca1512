"""The commands take the name of an experiment that the service has stored."""

import json
import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_command_takes_the_name_of_a_stored_experiment(tmp_path, write_measured_experiment, command):
    write_measured_experiment(tmp_path / "experiments" / "pendulum")
    environment = os.environ | {"COULOMB_DATA": str(tmp_path)}

    def coulomb(name):
        call = [sys.executable, "-m", "api", command, name, "--json"]
        return subprocess.run(call, env=environment, capture_output=True, text=True, timeout=100, check=False)

    found = coulomb("pendulum")
    assert found.returncode == 0, found.stderr
    assert json.loads(found.stdout)["experiment"] == "pendulum"
    unknown = coulomb("swing")
    assert unknown.returncode == 2
    assert "stored are: pendulum" in unknown.stderr
    assert unknown.stdout == ""
