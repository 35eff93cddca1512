"""The variable that an effect's picture shows the residual over."""

from dataclasses import dataclass
from typing import Literal

Samples = Literal["position", "velocity", "speed", "acceleration", "load", "travel", "time", "temperature"]
"""Arrays of a joint's samples by name; `speed` is |q̇|, `travel` the way since the last reversal."""

Dimension = Literal["position", "speed", "acceleration", "load", "time", "temperature"]
"""What the variable is measured in: rad or m, rad/s or m/s, rad/s² or m/s², N m or N, s, °C."""


Shape = Literal["band", "quadrants", "loop", "reversals"]
"""How it is drawn: a band over the variable; apart for the quadrants of speed and load; forward and backward as a loop; or
measured against predicted around the mean reversal."""


@dataclass(frozen=True)
class PictureVariable:
    """What the residual is drawn over so that an effect shows.

    samples : name of the samples' array
    label   : of the axis, without its unit
    dimension : from which the unit follows, by whether the joint turns or slides
    error_turned : whether the error is multiplied by sign(q̇) first, so that loss shows above zero and both
                   directions fall on one curve
    shape : in which an effect of that variable is obvious
    """

    samples: Samples
    label: str
    dimension: Dimension
    error_turned: bool = False
    shape: Shape = "band"


OVER_SPEED = PictureVariable("velocity", "speed", "speed")
OVER_SIZE_OF_SPEED = PictureVariable("speed", "magnitude of the speed", "speed", error_turned=True)
OVER_POSITION = PictureVariable("position", "position", "position")
LOSS_OVER_POSITION = PictureVariable("position", "position", "position", error_turned=True)
OVER_LOAD = PictureVariable("load", "load", "load")
LOSS_OVER_LOAD = PictureVariable("load", "load", "load", error_turned=True, shape="quadrants")
OVER_TRAVEL = PictureVariable(
    "travel", "travel since the last reversal", "position", error_turned=True, shape="loop"
)
AROUND_REVERSALS = PictureVariable(
    "travel", "travel since the last reversal", "position", error_turned=True, shape="reversals"
)
OVER_ACCELERATION = PictureVariable("acceleration", "acceleration", "acceleration")
OVER_TIME = PictureVariable("time", "time", "time", error_turned=True)
OVER_TEMPERATURE = PictureVariable("temperature", "temperature", "temperature", error_turned=True)

BY_SIGNAL = {
    "dq": OVER_SPEED,
    "q": OVER_POSITION,
    "ddq": OVER_ACCELERATION,
    "load": OVER_LOAD,
    "time": OVER_TIME,
    "travel since reversal": OVER_TRAVEL,
}
"""Pictures by `Effect.variable`, for effects that do not say more."""


def picture_over(variable: str | None) -> PictureVariable:
    """The picture over a variable as `Effect.variable` and the diagnosis name it; over speed where none is known."""
    return BY_SIGNAL.get(variable or "", OVER_SPEED)
