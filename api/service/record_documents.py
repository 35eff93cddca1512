"""Other people's records as documents: what they hold, and how they become an experiment."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from api.service import text_forms
from api.service.request_document import RequestDocument
from identify.recording.plain_text import Printable

Word = Annotated[str, Field(min_length=1, max_length=200)]
Value = Annotated[float, Field(allow_inf_nan=False, ge=-1e12, le=1e12)]


class Dialect(BaseModel):
    """What overrules the detection of a table in text; null: told by the cells."""

    header_line: int | None = Field(
        default=None, ge=0, le=100_000, description="from 1; 0: no header", examples=[3]
    )
    separator: str | None = Field(
        default=None, max_length=10, description="a sign, or comma, semicolon, tab, space"
    )
    decimal: Literal[".", ","] | None = None


class RecordColumn(BaseModel):
    """One column of a record."""

    name: str = Field(
        description="as an import names it: #K for the K-th without a name", examples=["Lage [Grad]"]
    )
    unit: str | None = Field(description="stated by the file", examples=["deg"])
    samples: int = Field(examples=[6000])
    smallest: float | None = Field(description="as in the file; null for words", examples=[-90.0])
    largest: float | None = Field(examples=[90.0])
    first: str = Field(description="the first cell", examples=["12.5"])
    outline: list[float | None] = Field(
        description="smallest and largest value block by block; null where there is none",
        examples=[[-90.0, -80.0, -85.0, -60.0]],
    )


class RecordDescription(BaseModel):
    """What one file holds, and what its columns probably are."""

    file: str = Field(examples=["messung.csv"])
    decided: list[str] = Field(description="while reading, in words", examples=[["separator ';'"]])
    columns: list[RecordColumn]
    left_off: int = Field(description="columns beyond those that are described", examples=[0])
    numbers: dict[str, float] = Field(description="single numbers of the file", examples=[{"gain": 35.15}])
    time: str | None = Field(description="the column that is probably the time", examples=["Zeit [ms]"])
    rate: float | None = Field(
        default=None, description="Hz, where the file states it and has no time column", examples=[500.0]
    )
    position: list[str] = Field(description="probable positions, base to tip", examples=[["Lage [Grad]"]])
    command: list[str] = Field(description="probable commands", examples=[["Motorstrom [mA]"]])


class JointOfRecord(RequestDocument):
    """Where the record of one joint stands, and its place in the robot."""

    name: Printable | None = Field(default=None, min_length=1, max_length=64)
    position: Word
    position_unit: str | None = Field(
        default=None, max_length=40, description="null: by the file, else rad or m"
    )
    resolution: Value | None = Field(
        default=None, description="counts per turn or metre, for positions in counts"
    )
    command: Word
    command_unit: str | None = Field(default=None, max_length=40, description="null: by the file, else A")
    external: Word | None = Field(
        default=None, description="column of the known external force, N m or N; of every joint, or of none"
    )
    temperature: Word | None = Field(
        default=None, description="column of the temperature, °C; of every joint, or of none"
    )
    gain: Value | None = Field(
        default=None, description="joint torque for one unit of command; may be left out with a robot's file"
    )
    type: Literal["revolute", "prismatic"] = "revolute"
    dh: tuple[Value, Value, Value, Value] = Field(
        default=(0.0, 0.0, 0.0, 0.0), description="alpha, d, theta, r (modified Denavit-Hartenberg; rad, m)"
    )


class CarriedPayload(RequestDocument):
    """What the robot carried."""

    name: Printable = Field(default="none", min_length=1, max_length=100)
    mass: float = Field(default=0.0, ge=0, le=1e5, allow_inf_nan=False, description="kg")
    com: tuple[Value, Value, Value] = Field(
        default=(0.0, 0.0, 0.0), description="in the last link's frame, m"
    )


class CanLogImport(RequestDocument):
    """How logs of a CAN bus become sessions, by the mapping of a rig."""

    rig: Word = Field(description="id of the rig whose drives were logged", examples=["rx130l-joint3"])
    name: Printable = Field(
        default="records",
        min_length=1,
        max_length=100,
        pattern=text_forms.WITHOUT_SLASHES,
        examples=["lab-arm"],
    )
    experiment: Word | None = Field(default=None, description="id of an experiment that gets the sessions")
    payload: Word = Field(default="none", description="one of the rig's")
    role: Literal["identification", "validation"] = "identification"
    begin: Value | None = Field(default=None, description="s from the log's first SYNC")
    end: Value | None = Field(
        default=None, description="likewise; without both: while all drives were enabled"
    )


class RecordImport(RequestDocument):
    """How files become the sessions of a new experiment."""

    name: Printable = Field(
        default="records",
        min_length=1,
        max_length=100,
        pattern=text_forms.WITHOUT_SLASHES,
        examples=["lab-arm"],
    )
    experiment: Word | None = Field(
        default=None,
        description="id of an experiment that gets the sessions: its robot is theirs; name, gains and gravity are not used then",
    )
    role: Literal["identification", "validation"] = "identification"
    joints: list[JointOfRecord] = Field(min_length=1, max_length=32, description="base to tip")
    keep: list[Word] = Field(default=[], max_length=100, description="further columns to keep")
    time: list[Word] = Field(default=[], description="one for all files, or with `join` one for each")
    time_unit: str | None = Field(default=None, max_length=20, description="null: by the file, else s")
    rate: float | None = Field(
        default=None, gt=0, le=1e9, allow_inf_nan=False, description="Hz, without a time column"
    )
    payloads: list[CarriedPayload] = Field(
        default=[CarriedPayload()], min_length=1, description="one, or one for each file"
    )
    join: bool = Field(default=False, description="all files are one session, joined on their times")
    repair: Literal["drop", "bridge"] | None = Field(
        default=None, description="of missing values and stamps that repeat"
    )
    gravity: tuple[Value, Value, Value] | None = Field(
        default=None, description="in the base frame, m/s²; may be left out with a robot's file"
    )
    tip: str | None = Field(
        default=None, max_length=200, description="link of the robot's file at which the chain ends"
    )
    dialect: Dialect = Dialect()
