"""The fitted parameters by name, with their deviations."""

from dataclasses import dataclass

import numpy as np

from identify.effects.admissible import named_parameters
from identify.effects.load_velocity import LoadVelocity, linear_names
from identify.effects.model import Term
from identify.effects.transmission import MotorInertia
from identify.estimation.fitted_model import FittedModel
from identify.estimation.record import Record
from identify.results import identification as documents


@dataclass(frozen=True)
class Parameter:
    """An estimated parameter.

    std, std_robust : standard deviations of eq. (13)-(15), and ones that hold for coloured residuals; None
    where
                      they cannot be given
    doubt           : what makes the value meaningless or impossible, in words
    """

    name: str
    joint: str
    value: float
    std: float | None
    std_robust: float | None
    unit: str
    grouping: str | None
    doubt: str | None = None

    @property
    def relative_std_percent(self) -> float | None:
        """eq. (16)"""
        return None if self.std is None or self.value == 0 else 100 * self.std / abs(self.value)

    def document(self) -> documents.Parameter:
        """Its entry in the document of an identification."""
        return documents.Parameter(
            name=self.name,
            joint=self.joint,
            value=self.value,
            std=self.std,
            std_robust=self.std_robust,
            relative_std_percent=self.relative_std_percent,
            unit=self.unit,
            grouping=self.grouping,
            doubt=self.doubt,
        )


def column_names(fitted: FittedModel) -> list[tuple[str, str, str, str | None]]:
    """Name, joint, unit and grouping of every column."""
    record = fitted.record
    base = record.body.base
    described: list[tuple[str, str, str, str | None]] = [
        (name, joint, unit, grouping)
        for name, joint, unit, grouping in zip(
            base.names, base.joints, base.units, base.groupings, strict=True
        )
    ]
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        described += slot_names(record, slot.term, slot.values, len(columns))
    return described


def slot_names(
    record: Record, term: Term, constants: dict[str, float], count: int
) -> list[tuple[str, str, str, str | None]]:
    """Name, joint, unit of an effect's columns."""
    summary = record.summaries[term.joint]
    if isinstance(term.effect, LoadVelocity):
        carried = record.body.gear_parameters(term.joint)
        names = [record.body.base.names[index] for index in carried]
        units = [record.body.base.units[index] for index in carried]
        if term.joint in record.body.shared_motors:
            name, unit = rotor_name(term.joint)
            names, units = [*names, name], [*units, unit]
        listed = linear_names(names, units)
        suffix = "" if record.joints == 1 else f"@{summary.name}"
        return [(name + suffix, summary.name, _unit(unit, summary.revolute), None) for name, unit in listed]
    listed = named_parameters(term, constants, count, summary)
    across = term.effect.rows == "robot"
    return [
        (
            each.name if across else f"{each.name}{term.joint + 1}",
            summary.name,
            _unit(each.unit, summary.revolute),
            None,
        )
        for each in listed
    ]


def rotor_name(motor: int) -> tuple[str, str]:
    """Name and unit of the inertia of a shared motor's rotor, as `motor-inertia` has them."""
    (parameter,) = MotorInertia.parameters
    return f"{parameter.name}{motor + 1}", parameter.unit


def _unit(unit: str, revolute: bool) -> str:
    return unit if revolute else unit.replace("N m", "N").replace("rad", "m")


def parameters_of(fitted: FittedModel) -> tuple[Parameter, ...]:
    """The fitted parameters with their deviations; the payload ratio as M_ae/M_aw, 1 where the payload is as
    declared."""
    std, robust = fitted.deviations
    named = column_names(fitted)
    shifted = np.zeros(len(named))
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        shifted[columns] = slot.term.effect.reported_offset(slot.values)
        if isinstance(slot.term.effect, LoadVelocity):
            names = [named[column][0].partition("@")[0] for column in columns]
            shifted[columns] = [1.0 if name in ("a_m", "a_g") else 0.0 for name in names]
    return tuple(
        Parameter(
            named[column][0],
            named[column][1],
            float(fitted.fit.chi[column] + shifted[column]),
            number(float(std[column])),
            number(float(robust[column])),
            named[column][2],
            named[column][3],
        )
        for column in fitted.fit.fitted
    )


def number(value: float | None) -> float | None:
    """A figure for JSON: None where it cannot be given."""
    return None if value is None or not np.isfinite(value) else float(value)
