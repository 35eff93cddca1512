"""The public package figaroh 1.0.2 on an experiment of ours: what `identify_versus_figaroh.py` runs and
times.

    python figaroh_on_a_record.py EXPERIMENT_FOLDER ROBOT.urdf

It does with figaroh what `coulomb identify` does by default: reads every session, takes torque = gain matrix
times command, filters, differentiates, builds the regressor with friction, rotor inertia and offset, finds
the base parameters, decimates torque and regressor alike, solves weighted least squares on the identification
sessions and predicts the validation ones. Needs figaroh and PyYAML, nothing of ours. Prints one JSON document
as its last line.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from figaroh.identification.base_identification import BaseIdentification
from figaroh.tools.load_robot import load_robot

POSITION_CUTOFF = 50.0  # Hz, as the record's own notes suggest
DECIMATION = 10  # figaroh's default


def settings_text(joints: list[str], sampling_frequency: float, validation: str) -> str:
    """figaroh's own configuration file for this robot."""
    zeros = [0.0] * len(joints)
    return yaml.safe_dump(
        {
            "robot": {
                "name": "robot",
                "properties": {
                    "joints": {"active_joints": joints, "joint_limits": {}},
                    "mechanics": {
                        "reduction_ratios": [1.0] * len(joints),
                        "friction_coefficients": {"viscous": zeros, "static": zeros},
                        "actuator_inertias": zeros,
                        "joint_offsets": zeros,
                    },
                    "coupling": {"has_coupled_wrist": False},
                },
            },
            "tasks": {
                "identification": {
                    "enabled": True,
                    "problem": {
                        "include_external_forces": False,
                        "use_joint_torques": True,
                        "model_components": {
                            "friction": True,
                            "actuator_inertia": True,
                            "joint_offset": True,
                        },
                    },
                    "signal_processing": {
                        "sampling_frequency": sampling_frequency,
                        "cutoff_frequency": POSITION_CUTOFF,
                        "filter_order": 4,
                    },
                    "data": {"validation_data_file": validation},
                }
            },
        }
    )


class Record(BaseIdentification):
    """figaroh's pipeline fed from an experiment folder."""

    def __init__(self, robot, config_file, folder, description):
        super().__init__(robot, config_file)
        self.folder = folder
        self.description = description
        ids = [robot.model.getJointId(name) for name in self.identif_config["active_joints"]]
        joints = [robot.model.joints[index] for index in ids]
        self.identif_config["act_Jid"] = ids
        self.identif_config["act_J"] = joints
        self.identif_config["act_idxq"] = [joint.idx_q for joint in joints]
        self.identif_config["act_idxv"] = [joint.idx_v for joint in joints]

    def load_trajectory_data(self, data_source=None):
        role = data_source or "identification"
        files = [
            session["file"]
            for session in self.description["sessions"]
            if session.get("role", "identification") == role
        ]
        table = pd.concat([pd.read_csv(self.folder / file) for file in files], ignore_index=True)
        n = len(self.identif_config["active_joints"])
        command = table[[f"v{k + 1}" for k in range(n)]].to_numpy()
        gains = np.array(self.description["robot"]["drive_gain_matrix"])
        return {
            "timestamps": table[["t"]].to_numpy(),
            "positions": table[[f"q{k + 1}" for k in range(n)]].to_numpy(),
            "velocities": None,
            "accelerations": None,
            "torques": command @ gains.T,
        }


def main(folder: Path, urdf: Path) -> None:
    """Identify and print what came out."""
    description = yaml.safe_load((folder / "experiment.yaml").read_text())
    joints = [joint["name"] for joint in description["robot"]["joints"]]
    first = pd.read_csv(folder / description["sessions"][0]["file"], usecols=["t"], nrows=2)["t"]
    with tempfile.TemporaryDirectory() as scratch, contextlib.redirect_stdout(io.StringIO()):
        config = Path(scratch) / "robot.yaml"
        config.write_text(settings_text(joints, 1.0 / float(first[1] - first[0]), "validation"))
        robot = load_robot(str(urdf))
        run = Record(robot, str(config), folder, description)
        run.initialize()
        run.solve(decimate=True, decimation_factor=DECIMATION, plotting=False, wls=True)
    residual = run.tau_noised - run.tau_identif
    print(
        json.dumps(
            {
                "base_parameters": len(run.phi_base),
                "rows": len(run.tau_noised),
                "relative_error": float(np.linalg.norm(residual) / np.linalg.norm(run.tau_noised)),
                "validated": bool(run._val_available),
            }
        )
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
