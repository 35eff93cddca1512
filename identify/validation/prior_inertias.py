"""Identified base parameters beside those of the links that the experiment declares, or a file of the robot states (URDF, SDF,
MJCF; mostly from CAD).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identify.dynamics.payload import payload_parameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.estimation.identified import Identified
from identify.recording.errors import InputError
from identify.recording.experiment_file import PriorBodies, Robot
from identify.results.identification import Parameter, PriorComparison, PriorParameter

SAME_FRAME = 1e-4
"""rad or m by which the experiment's frames may differ from the file's: numbers of a robot are typed with four digits."""
FAR = 3.0
"""standard deviations beyond which a difference is no chance"""


def prior_of_file(path: Path, tip: str | None, robot: Robot) -> PriorBodies:
    """The links of a file of the experiment's robot.

    Raises InputError: the file is not of that robot, by joint and field; states no mass; or cannot be read.
    """
    # what reads XML is loaded only where a file is compared with
    from identify.dynamics.urdf import read_urdf

    read = read_urdf(path, tip=tip)
    _refuse_another_robot(path, read.robot, robot)
    prior = read.prior(path.name)
    if prior is None:
        raise InputError(f"{path}: states no mass of any link; there is nothing to compare with")
    return prior


def compared_with_prior(
    result: Identified, parameters: Sequence[Parameter], prior: PriorBodies
) -> PriorComparison:
    """The base parameters by the bodies of a file beside those in `parameters`.

    A file has no rotors: where a parameter groups an Ia, the file's value lacks it.
    """
    base = result.fitted.record.body.base
    standard = np.zeros((len(prior.links), PARAMETERS_PER_JOINT))
    standard[:, :10] = [payload_parameters(link) for link in prior.links]
    stated = dict(zip(base.names, base.from_standard(standard.ravel()), strict=True))
    estimated = {parameter.name: parameter for parameter in parameters if parameter.name in stated}
    rows: list[PriorParameter] = []
    for name, unit, joint, grouping in zip(base.names, base.units, base.joints, base.groupings, strict=True):
        estimate = estimated.get(name)
        deviation = estimate.std_robust if estimate is not None else None
        rows.append(
            PriorParameter(
                name=name,
                joint=joint,
                unit=unit,
                by_file=float(stated[name]),
                identified=None if estimate is None else estimate.value,
                std_robust=deviation,
                deviations=None
                if estimate is None or not deviation
                else (estimate.value - float(stated[name])) / deviation,
                rotor="Ia" in grouping or name.startswith("Ia"),
            )
        )
    far = [
        row.name for row in rows if not row.rotor and row.deviations is not None and abs(row.deviations) > FAR
    ]
    remarks = [*prior.remarks]
    if any(row.rotor for row in rows):
        remarks.append("the file knows no rotors: values by it lack the Ia that are grouped into them")
    if far:
        remarks.append(
            f"identified differently by more than {FAR:g} standard deviations: {', '.join(far)}; masses or centres in the"
            " file are not those of the robot (cables, covers, tools), or the drive gains are wrong"
        )
    return PriorComparison(file=prior.source, parameters=tuple(rows), remarks=tuple(remarks))


def _refuse_another_robot(path: Path, file: Robot, experiment: Robot) -> None:
    names = [[joint.name for joint in robot.joints] for robot in (file, experiment)]
    if names[0] != names[1]:
        raise InputError(
            f"{path}: has the joints {', '.join(names[0])}, the experiment {', '.join(names[1])}; name the --tip, or give"
            " the file that the experiment was made of"
        )
    for stated, declared in zip(file.joints, experiment.joints, strict=True):
        for field in ("type", "alpha", "d", "theta", "r"):
            one, other = getattr(stated, field), getattr(declared, field)
            if one == other:
                continue
            if field == "type" or _apart(one, other, turns=field in ("alpha", "theta")) > SAME_FRAME:
                raise InputError(
                    f"{path}: joint '{declared.name}': {field} is {one if field == 'type' else f'{one:.6g}'}, in the experiment"
                    f" {other if field == 'type' else f'{other:.6g}'}; its inertias are in other frames"
                )


def _apart(one: float, other: float, turns: bool) -> float:
    difference = abs(one - other)
    return abs((difference + np.pi) % (2 * np.pi) - np.pi) if turns else difference
