"""What a process of the acquisition loads: nothing that it does not need, whatever else is installed."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize("module", ["daq.acquisition", "daq.recorder", "daq.can_log"])
def test_a_process_of_a_session_loads_no_tables(module):
    pytest.importorskip("asammdf", reason="the extra 'mdf' is not installed")
    heavy = "{'asammdf', 'pandas', 'pyarrow', 'scipy'}"
    program = f"import sys, {module}; print(sorted({heavy} & sys.modules.keys()))"
    assert subprocess.check_output([sys.executable, "-c", program], text=True).strip() == "[]"


def test_asammdf_is_there_for_who_wants_it():
    pytest.importorskip("asammdf", reason="the extra 'mdf' is not installed")
    program = "import drivers, asammdf; print(asammdf.MDF.__name__)"
    assert subprocess.check_output([sys.executable, "-c", program], text=True).strip() == "MDF"
