"""Where a drive keeps its own compensation of friction and cogging, as the section `compensation` of a profile says it.

The drive adds a current of its own to what its loops ask for. Of friction it is a line over the commanded speed through
support points: zero at standstill, straight to the first point and from point to point, held beyond the last. Of cogging it
is a line through points at equal distances over one turn of the motor, the first where the encoder counts zero.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from drivers.object_kinds import OBJECT_KINDS, ObjectType

SpeedUnit = Literal["rad/s", "rpm"]
CurrentUnit = Literal["A", "N m", "rated current", "rated torque"]

_RADIANS = {"rad/s": 1.0, "rpm": 2.0 * np.pi / 60.0}


class _Row(BaseModel):
    """Objects with consecutive sub-indices, a support point each."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    index: int = Field(ge=0x1000, le=0xFFFF, description="index, e.g. 0x2020")
    subindex: int = Field(default=1, ge=0, le=0xFE, description="of the first point")
    points: int = Field(default=1, ge=1, le=254, description="number of points, a sub-index each")
    type: ObjectType = Field(description="type of the raw values")
    scale: float = Field(gt=0, description="unit per raw count")
    largest: float | None = Field(default=None, gt=0, description="largest magnitude taken, in the unit")
    source: str = Field(description="manual's name and section")

    def raw(self, values: NDArray[np.float64]) -> tuple[float, ...]:
        """Raw values of (points,) values in the row's unit.

        Raises ValueError where one is beyond what the object holds.
        """
        kind = np.dtype(OBJECT_KINDS[self.type])
        if self.largest is not None and np.abs(values).max() > self.largest:
            raise ValueError(
                f"{self}: {np.abs(values).max():.4g} is beyond the largest value, {self.largest:g}"
            )
        if kind.kind == "f":
            return tuple(float(np.float32(value / self.scale)) for value in values)
        raw = np.rint(values / self.scale)
        lowest, highest = np.iinfo(kind).min, np.iinfo(kind).max
        if raw.min() < lowest or raw.max() > highest:
            raise ValueError(f"{self}: {values[np.abs(raw).argmax()]:.4g} does not fit {self.type}")
        return tuple(int(value) for value in raw)

    def __str__(self) -> str:
        last = self.subindex + self.points - 1
        return f"0x{self.index:04X}:{self.subindex:02X}" + (f" to {last:02X}" if self.points > 1 else "")


class SpeedRow(_Row):
    """Speeds of the motor at the support points, rising."""

    unit: SpeedUnit

    @property
    def radians(self) -> float:
        """rad/s that the row's unit is."""
        return float(_RADIANS[self.unit])


class CurrentRow(_Row):
    """Currents at the support points; where the unit is a torque, the motor's by its torque constant."""

    unit: CurrentUnit


class FrictionObjects(BaseModel):
    """Friction over speed. Without `backward` the forward half is mirrored, sign and all."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    speeds: SpeedRow
    forward: CurrentRow = Field(description="currents at positive speeds")
    backward: CurrentRow | None = Field(
        default=None, description="currents at negative speeds, with their sign"
    )
    constant: CurrentRow | None = Field(default=None, description="current in both directions, also at rest")

    def model_post_init(self, context: object) -> None:
        """Every speed has its current."""
        for row in (self.forward, self.backward):
            if row is not None and row.points != self.speeds.points:
                raise ValueError(f"{row} has {row.points} points, the speeds {self.speeds.points}")


class CompensationObjects(BaseModel):
    """What of a drive's own compensation can be written."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    friction: FrictionObjects | None = None
    cogging: CurrentRow | None = Field(default=None, description="over one turn of the motor")
    remarks: tuple[str, ...] = Field(default=(), description="what the operator must know before writing")
