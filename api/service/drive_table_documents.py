"""Tables written to drives, as documents."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from identify.results.drive_tables import DriveTablesDocument
from identify.results.reading import of_any_version

Tables = Annotated[DriveTablesDocument, of_any_version(DriveTablesDocument)]
State = Literal["begun", "written", "refused"]


class TablesWriting(BaseModel):
    """One writing to the drives of a rig."""

    model_config = ConfigDict(frozen=True)

    format: Literal[1] = 1
    number: str = Field(description="within the experiment", examples=["00"])
    state: State = Field(
        description="`begun`: it did not come to its end, and the drives may hold some of both; `refused`: a drive refused, and"
        " all hold what they held before",
        examples=["written"],
    )
    reason: str = Field(description="why a drive refused; else empty", examples=[""])
    version: str | None = Field(
        description="of the model; null where it is what the drives held before another writing",
        examples=["m2"],
    )
    undoes: str | None = Field(description="the writing that was taken back", examples=[None])
    rig: str = Field(examples=["rx130l-joint3-simulated"])
    operator: str = Field(examples=["ada"])
    created: str = Field(description="ISO 8601, UTC", examples=["2026-11-28T09:00:00+00:00"])
    tables: Tables = Field(description="what the drives were to hold, and held before")
