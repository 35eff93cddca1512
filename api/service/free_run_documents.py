"""A joint's free run as a document: measured and simulated motion over time."""

from pydantic import BaseModel, Field


class Curves(BaseModel):
    """Position or speed over the times of a free run; null where there is none, as beyond the end of a run."""

    measured: list[float | None] = Field(examples=[[0.0, 0.1]])
    model: list[float | None] = Field(examples=[[0.0, 0.1]])
    usual: list[float | None] = Field(
        description="the usual model (eq. 8); all null where the model is that", examples=[[0.0, 0.1]]
    )
    error: list[float | None] = Field(description="model less measured", examples=[[0.0, 0.0]])
    error_usual: list[float | None] = Field(description="usual model less measured", examples=[[0.0, 0.0]])


class FreeRunView(BaseModel):
    """One joint's free run in one session, as pictures show it: of a long session least and greatest value of a short time in
    turn."""

    session: str = Field(description="the session's file", examples=["session-00.csv"])
    joint: str = Field(examples=["j3"])
    time: list[float | None] = Field(
        description="s into the session; null between stretches of a record with holes",
        examples=[[0.0, 0.004]],
    )
    position: Curves = Field(description="rad or m")
    speed: Curves = Field(description="rad/s or m/s")
