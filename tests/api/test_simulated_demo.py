"""What every demo is made of: its plan, its payloads and the folder that it takes."""

from pathlib import Path

import numpy as np

from api.simulated_demo import PAYLOADS, PLAN, RIG, fresh_folder
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import violations
from daq.rig import Rig


def test_a_demo_takes_the_first_folder_that_is_not_there(tmp_path: Path):
    taken = []
    for _ in range(3):
        folder = fresh_folder(tmp_path)
        folder.mkdir()
        taken.append(folder.name)
    assert taken == ["demo", "demo-2", "demo-3"]
    (tmp_path / "demo-2").rmdir()
    assert fresh_folder(tmp_path).name == "demo-2"


def test_the_plan_is_one_of_the_simulated_arm_whose_payloads_differ():
    rig = Rig.load(RIG)
    assert rig.simulated is not None
    plan = ExcitationPlan.load(PLAN)
    assert (plan.rig, violations(plan, rig)) == (RIG, [])
    masses = [rig.payload(name).mass for name in PAYLOADS]
    assert masses[0] == 0.0
    assert np.all(np.diff(masses) > 3.0)
