"""Six coupled axes on one bus: what is identified from a recorded payload session, against the robot's own parameters.

Dry friction is taken out of the load here, so that the usual model is the whole truth and every base parameter has one
value. Motor 6 turns with joints 5 and 6, so its friction and its rotor are `coupled-friction`.
"""

import numpy as np
import pytest

from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from identify.diagnosis.diagnosis import diagnose
from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.geometry import Geometry
from identify.identification import identify

SHARED = 5
"""index of the motor that two joints share"""


@pytest.fixture(scope="module")
def robot():
    """The TX40 rig with dry friction that depends on neither load nor speed."""
    rig = Rig.load("tx40-simulated")
    axes = []
    for axis in rig.simulated["plant"]["axes"]:
        friction = {name: axis["friction"][name] for name in ("viscous", "offset", "stribeck_velocity")}
        dry = axis["friction"]["dry_driving"]
        axes.append({**axis, "friction": {**friction, "dry_driving": dry, "dry_backdriving": dry}})
    plant = {**rig.simulated["plant"], "axes": axes}
    return rig.model_copy(update={"simulated": {**rig.simulated, "plant": plant}})


@pytest.fixture(scope="module")
def experiment(robot, recorded, tmp_path_factory):
    folder = tmp_path_factory.mktemp("six") / "axes"
    return recorded(robot, standard_plan(robot, 16.0), folder, ("none", "cylinder-2"), patience=300)


def standard_parameters(plant) -> np.ndarray:
    """(66,) of every link about its own frame, XX XY XZ YY YZ ZZ MX MY MZ M Ia; the shared motor's rotor left out."""
    found = []
    for index, (link, axis) in enumerate(zip(plant["links"], plant["axes"], strict=True)):
        mass, centre = link["mass"], np.array(link["com"])
        xx, xy, xz, yy, yz, zz = link["inertia"]
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        tensor = tensor + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))  # Steiner
        rotor = axis["motor"]["gear_ratio"] ** 2 * axis["motor"]["rotor_inertia"]
        inertia = tensor[np.triu_indices(3)]
        found += [*inertia, *(mass * centre), mass, 0.0 if index == SHARED else rotor]
    return np.array(found)


@pytest.fixture(scope="module")
def truth(robot, experiment):
    plant = robot.simulated["plant"]
    base = base_parameters(Geometry.from_robot(experiment.robot))
    known = dict(zip(base.names, base.from_standard(standard_parameters(plant)), strict=True))
    # An offset of a motor acts on every joint that the motor turns with.
    offsets = np.array(plant["coupling"]).T @ [axis["friction"]["offset"] for axis in plant["axes"]]
    for index, axis in enumerate(plant["axes"]):
        viscous, dry = axis["friction"]["viscous"], axis["friction"]["dry_driving"]
        if index == SHARED:
            motor = axis["motor"]
            known |= {"FVM6": viscous, "FCM6": dry, "IaM6": motor["gear_ratio"] ** 2 * motor["rotor_inertia"]}
            viscous = dry = 0.0
        known |= {f"FV{index + 1}": viscous, f"FC{index + 1}": dry, f"offset{index + 1}": offsets[index]}
    return known


def test_every_parameter_of_six_axes_agrees_with_the_robots_own_within_three_robust_deviations(
    experiment, truth
):
    result = identify(experiment, "usual", add=["coupled-friction"]).document()
    found = {p.name: (p.value - truth[p.name]) / p.std_robust for p in result.parameters if p.name in truth}
    assert truth.keys() <= found.keys(), truth.keys() - found.keys()
    assert max(map(abs, found.values())) < 3.0, found
    assert result.relative_error < 0.005


@pytest.mark.slow
def test_the_diagnosis_of_the_usual_model_names_the_motor_that_two_joints_share(experiment):
    joints = {joint.joint: joint for joint in diagnose(experiment, "usual").document().joints}
    for name in ("j5", "j6"):
        assert joints[name].verdict == "missing"
        assert joints[name].missing[0] == "coupled-friction"
