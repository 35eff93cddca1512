"""An effect as documents name it, and its entry in the catalogue: `coulomb effects --json`."""

from pydantic import Field

from identify.results.document import Part


class EffectOnJoint(Part):
    """One effect of a model, on one joint."""

    effect: str = Field(description="name in the catalogue", examples=["viscous"])
    joint: str = Field(description="name of the joint", examples=["j3"])

    def __str__(self) -> str:
        """`effect@joint`, as the command line spells it."""
        return f"{self.effect}@{self.joint}"


class CatalogueParameter(Part):
    """A parameter that an effect adds to the model."""

    name: str = Field(description="symbol, without the joint's number", examples=["FV"])
    unit: str = Field(description="of a revolute joint", examples=["N m s/rad"])


class EffectPicture(Part):
    """What the residual is drawn over so that an effect shows."""

    samples: str = Field(description="the samples along the axis", examples=["velocity"])
    label: str = Field(description="of the axis, without its unit", examples=["speed"])
    dimension: str = Field(
        description="position, speed, acceleration, load, time or temperature; the unit follows from it",
        examples=["speed"],
    )
    error_turned: bool = Field(
        description="whether the error is multiplied by the sign of the velocity first", examples=[False]
    )
    shape: str = Field(
        default="band",
        description="band, quadrants (apart for motor and generator), loop (forward and backward) or reversals (measured and "
        "predicted around them)",
        examples=["band"],
    )


class CatalogueEffect(Part):
    """One effect of the catalogue."""

    effect: str = Field(description="name in the catalogue", examples=["viscous"])
    title: str = Field(description="name in an operator's words", examples=["viscous friction"])
    group: str = Field(description="what sort of effect it is", examples=["friction"])
    equation: str = Field(description="the torque it adds", examples=["F_v·dq"])
    explanation: str = Field(
        description="in an operator's words", examples=["Friction that grows with the speed, as of oil."]
    )
    regressors: tuple[str, ...] = Field(
        description="columns of the observation matrix, one for each parameter", examples=[["dq"]]
    )
    parameters: tuple[CatalogueParameter, ...] = Field(description="what is estimated of it")
    needs: tuple[str, ...] = Field(description="what the data must hold for it to show", examples=[[]])
    source: str = Field(description="equation, book or paper", examples=["eq. (8)"])
    picture: EffectPicture = Field(description="what its picture shows the residual over")
    indistinguishable_from: tuple[str, ...] = Field(
        description="effects that it is easily taken for", examples=[["viscous-cubic"]]
    )
