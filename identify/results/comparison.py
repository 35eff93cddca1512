"""Models side by side on the same record: the document of `coulomb compare --json`."""

from typing import Literal

from pydantic import Field

from identify.results.document import Document, Figure, Part
from identify.results.identification import JointError, PayloadError, SessionError, SpeedError


class ModelErrors(Part):
    """The errors of one model, ‖Y − Wχ‖ / ‖Y‖; parts of the measured torque."""

    model: str = Field(description="the model and the effects added to it", examples=["usual + stribeck"])
    relative_error: Figure = Field(description="over all joints and sessions of the fit", examples=[0.0733])
    relative_error_validation: Figure = Field(description="on the validation sessions", examples=[0.081])
    joints: tuple[JointError, ...] = Field(description="errors of each joint")
    sessions: tuple[SessionError, ...] = Field(description="errors of each session")
    payloads: tuple[PayloadError, ...] = Field(description="errors by payload (Table IV)")
    speeds: tuple[SpeedError, ...] = Field(description="errors by speed (Table III)")
    form: Literal["linear", "structured"] = Field(description="of load-velocity", examples=["linear"])


class ComparisonDocument(Document):
    """The document of `coulomb compare --json`."""

    MADE_BY = "coulomb compare --json"

    experiment: str = Field(description="name of the experiment", examples=["rx130l-joint3"])
    models: tuple[ModelErrors, ...] = Field(description="in the order in which they were named")
    figures: tuple[str, ...] = Field(description="files that were drawn", examples=[["out/where.svg"]])
