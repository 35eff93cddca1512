"""`coulomb identify` and the public package figaroh on the same record, side by side in one run.

    python benchmarks/identify_versus_figaroh.py [EXPERIMENT_FOLDER] [--figaroh-python PATH] [--runs 3]

Each is a process of its own that starts from the files and ends with parameters, statistics and the error on
the validation sessions (`figaroh_on_a_record.py` does with figaroh what `coulomb identify` does by default).
Measured are wall time, CPU time (user and system, the process and its children) and peak resident memory, as
the kernel counts them (wait4). Printed is the run of least CPU time of each, and the ratios. figaroh 1.0.2 is
a dependency of this script alone; where it is installed elsewhere, name that interpreter.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from process_cost import measure

REPOSITORY = Path(__file__).resolve().parent.parent
TX40 = REPOSITORY.parent / "shared" / "data" / "tx40"


def write_figaroh_urdf(folder: Path, file: Path) -> None:
    """The experiment's robot as figaroh reads robots; the inertias are placeholders, it estimates them."""
    from identify.dynamics.urdf import write_urdf
    from identify.recording import JointLimits, load_experiment

    robot = load_experiment(folder).robot
    anywhere = JointLimits(position=(-1e3, 1e3))  # else the joints are `continuous`, held as cosine and sine
    joints = tuple(joint.model_copy(update={"limits": anywhere}) for joint in robot.joints)
    standard = np.zeros((len(joints), 11))
    standard[:, [0, 3, 5]] = 0.1
    standard[:, 9] = 1.0
    write_urdf(file, robot.model_copy(update={"joints": joints}), standard.ravel())


def main() -> None:
    """Measure both and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("experiment", nargs="?", type=Path, default=TX40)
    parser.add_argument("--figaroh-python", default=sys.executable, help="interpreter that has figaroh 1.0.2")
    parser.add_argument("--runs", type=int, default=3)
    chosen = parser.parse_args()
    if not (chosen.experiment / "experiment.yaml").is_file():
        raise SystemExit(
            f"{chosen.experiment}: no experiment.yaml; name the folder of a record with a gain matrix"
        )
    # As installed: pip compiles what it installs. Otherwise our sources would be compiled in every run, and figaroh's not.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    with tempfile.TemporaryDirectory() as scratch:
        urdf = Path(scratch) / "robot.urdf"
        write_figaroh_urdf(chosen.experiment, urdf)
        script = str(Path(__file__).with_name("figaroh_on_a_record.py"))
        commands = {
            "coulomb identify": [sys.executable, "-m", "api", "identify", str(chosen.experiment), "--json"],
            "figaroh 1.0.2": [chosen.figaroh_python, script, str(chosen.experiment), str(urdf)],
        }
        # by turns, so that what else the machine does meets both alike
        runs = [{name: measure(command) for name, command in commands.items()} for _ in range(chosen.runs)]
        costs = {name: min((run[name] for run in runs), key=lambda cost: cost.cpu) for name in commands}
    ours, theirs = costs["coulomb identify"], costs["figaroh 1.0.2"]
    print(f"{'':24}{'coulomb identify':>18}{'figaroh 1.0.2':>16}{'ratio':>8}")
    rows = (
        ("wall time, s", ours.wall, theirs.wall),
        ("CPU time, s", ours.cpu, theirs.cpu),
        ("peak memory, MB", ours.peak_memory / 1e6, theirs.peak_memory / 1e6),
    )
    for words, own, other in rows:
        print(f"{words:24}{own:18.2f}{other:16.2f}{other / own:8.1f}")
    error = ours.answer["relative_error"], theirs.answer["relative_error"]
    print(f"{'relative error, %':24}{100 * error[0]:18.2f}{100 * error[1]:16.2f}   (each on its own samples)")
    print(
        f"figaroh fitted {theirs.answer['base_parameters']} parameters on {theirs.answer['rows']} rows; ",
        end="",
    )
    print(f"ours are {len(ours.answer['parameters'])} on {ours.answer['samples']} samples")


if __name__ == "__main__":
    main()
