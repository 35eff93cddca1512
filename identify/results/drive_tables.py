"""Friction and cogging as the drives' own compensation takes them: the document of `coulomb drive-tables --json`."""

from pydantic import Field

from identify.results.document import Document, Figure, Part


class TableObject(Part):
    """One object of a drive."""

    object: str = Field(description="index and sub-index", examples=["0x2021:03"])
    type: str = Field(description="of the raw value", examples=["int32"])
    value: float = Field(description="what the object is to hold, in the drive's counts", examples=[412])
    before: float | None = Field(description="what it held before it was written; null where nothing was")


class DriveTable(Part):
    """A line through support points, in one drive's units."""

    of: str = Field(description="friction or cogging", examples=["friction"])
    points: tuple[tuple[float, ...], ...] = Field(
        description="friction: speed of the motor in rad/s, A forward, A backward; cogging: turn of the motor, A"
    )
    model: tuple[tuple[float, float, float, float], ...] = Field(
        default=(),
        description="what the model gives along the record in intervals of the same variable, negative backward: its mean, and"
        " median, tenth and ninetieth percentile of the current in A",
    )
    constant: Figure = Field(description="A, in both directions; null where the drive has no object for it")
    wanted: Figure = Field(description="A, root mean square over the record of what the model gives")
    left: Figure = Field(description="A, the same of what the table does not give")
    objects: tuple[TableObject, ...] = Field(description="what is written, in this order")


class JointTables(Part):
    """The tables of one drive."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    node: int = Field(description="CANopen node id", examples=[3])
    drive: str = Field(description="its profile", examples=["simulated"])
    tables: tuple[DriveTable, ...] = Field(description="none where the drive takes none")
    remarks: tuple[str, ...] = Field(description="what the operator must know before writing")
    drive_digest: str | None = Field(
        default=None,
        description="of the profile and the object dictionary that units and objects were taken from; the tables are not written"
        " once these are others. Null where values were read from the drive itself: those go back whatever the profile says",
    )


class DriveTablesDocument(Document):
    """The document of `coulomb drive-tables --json`."""

    MADE_BY = "coulomb drive-tables --json"

    experiment: str | None = Field(
        description="the model's; null where tables are cleared", examples=["rx130l-joint3"]
    )
    rig: str = Field(description="name of the rig", examples=["rx130l-joint3-simulated"])
    model: str | None = Field(
        description="as it was asked for; null where tables are cleared", examples=["load-velocity"]
    )
    written: bool = Field(description="whether the drives hold the tables now, read back")
    joints: tuple[JointTables, ...] = Field(description="in the order of the rig's axes")
    remarks: tuple[str, ...] = Field(description="what the reader must know of the model")
