"""The experiment that would tell rival effects apart: the document of `coulomb next --json`."""

from typing import Literal

from pydantic import Field

from identify.results.document import Document, Figure, Part

Shape = Literal["sinusoid", "trapezoid"]


class Proposal(Part):
    """An experiment that would tell two rival effects apart, and by how much.

    The joint moves between the two positions at up to the stated speed; rad and rad/s, or m and m/s.
    """

    payload: str = Field(description="the payload to mount", examples=["disk-7"])
    shape: Shape = Field(description="of the position, or of the velocity", examples=["trapezoid"])
    speed: float = Field(description="rad/s or m/s at most", examples=[0.36])
    position_from: float = Field(description="rad or m", examples=[-1.2])
    position_to: float = Field(description="rad or m", examples=[1.6])
    repeats: int = Field(description="of the whole motion", examples=[2])
    separation: Figure = Field(
        description="standard deviations of the noise by which the predictions part", examples=[14.2]
    )
    probability: Figure = Field(
        default=None,
        description="part that the right one of the two is expected to have of the probability that the diagnosis gives both;"
        " 0.5 tells nothing; null in answers stored before it was computed",
        examples=[0.97],
    )
    decides: bool = Field(description="whether that is enough to decide", examples=[True])


class NextExperimentDocument(Document):
    """The document of `coulomb next --json`."""

    MADE_BY = "coulomb next --json"

    experiment: str | None = Field(
        description="name of the experiment; null in answers stored before documents had a format",
        examples=["rx130l-joint3"],
    )
    joint: str | None = Field(description="null where no joint is in doubt", examples=["j3"])
    rivals: tuple[str, ...] = Field(
        description="the two effects to separate; empty where none are",
        examples=[["load-friction-asymmetric", "load-friction"]],
    )
    separation_so_far: Figure = Field(
        description="standard deviations by which the data so far part them", examples=[1.9]
    )
    probability_so_far: Figure = Field(
        default=None, description="as `probability`, of the data so far", examples=[0.62]
    )
    proposals: tuple[Proposal, ...] = Field(description="the best first")
    posture: tuple[float, ...] = Field(
        description="rad or m: where the joints are meanwhile", examples=[[0.2]]
    )
    advice: str = Field(
        description="what to do, in words",
        examples=["A trapezoid between -1.2 and 1.6 with payload disk-7 decides."],
    )
