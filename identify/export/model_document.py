"""An exported model as a document of data."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.export.exported_model import ExportedModel, MemoryKind, Torque
from identify.results.exported_model import (
    ExportedBaseParameter,
    ExportedLink,
    ExportedModelDocument,
    ExportedTorque,
)


def model_document(model: ExportedModel) -> ExportedModelDocument:
    """The document, which holds all of the model."""
    geometry = model.geometry
    links = model.standard.reshape(model.joints, -1)
    listed = zip(model.base.names, model.base.groupings, model.chi, model.base.units, strict=True)
    return ExportedModelDocument(
        experiment=model.experiment,
        model=model.name,
        gravity=_triple(geometry.gravity),
        across=None if model.across is None else (_triple(model.across[0]), _triple(model.across[1])),
        links=tuple(
            ExportedLink(
                joint=name,
                prismatic=bool(geometry.prismatic[joint]),
                alpha=float(geometry.alpha[joint]),
                d=float(geometry.d[joint]),
                theta=float(geometry.theta[joint]),
                r=float(geometry.r[joint]),
                standard=tuple(float(value) for value in links[joint]),
            )
            for joint, name in enumerate(geometry.names)
        ),
        base=tuple(
            ExportedBaseParameter(name=name, grouping=grouping, value=float(value), unit=unit)
            for name, grouping, value, unit in listed
        ),
        motor_shares=tuple(tuple(float(value) for value in row) for row in model.shares),
        torques=tuple(
            ExportedTorque(
                effect=torque.effect,
                joint=geometry.names[torque.row],
                motor=geometry.names[torque.motor],
                formulas=torque.formulas,
                values=torque.values,
                presliding_distance=_distance(torque, "fading"),
                play=_distance(torque, "play"),
                turns=torque.turns or None,
                derivative=torque.derivative,
            )
            for torque in model.torques
        ),
    )


def _triple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z


def _distance(torque: Torque, kind: MemoryKind) -> float | None:
    """Of a torque's memory, where it is of that kind."""
    return torque.memory.distance if torque.memory is not None and torque.memory.kind == kind else None
