"""What an exported model keeps of the identified one: the certificate beside every export."""

from pydantic import Field

from identify.results.document import Document, Figure, Part


class JointCertificate(Part):
    """One joint. Effects by name; "rigid body" is inertia, Coriolis, centrifugal and gravity torque."""

    joint: str = Field(description="name of the joint", examples=["j3"])
    kept: tuple[str, ...] = Field(description="exactly as identified", examples=[["rigid body", "viscous"]])
    approximated: tuple[str, ...] = Field(
        description="by what the format has, with the least error on the record", examples=[["load-friction"]]
    )
    lost: tuple[str, ...] = Field(description="the format has no place for it", examples=[["offset"]])
    relative_error_model: Figure = Field(
        description="of the identified model on the identification sessions", examples=[0.0404]
    )
    relative_error_export: Figure = Field(
        description="of the exported thing on the same samples, loaded back from the file; null where it was not measured",
        examples=[0.0404],
    )
    relative_difference: Figure = Field(
        default=None,
        description="of the file's torque from that of the model's formulas on the same samples, over the root mean square of the"
        " latter: rounding where all is kept",
        examples=[2.1e-16],
    )


class Certificate(Document):
    """The document `TARGET.certificate.json`."""

    MADE_BY = "coulomb export"

    target: str = Field(description="the file that was written", examples=["arm.c"])
    kind: str = Field(description="what sort of file it is", examples=["C source"])
    experiment: str = Field(description="name of the experiment", examples=["rx130l-joint3"])
    model: str = Field(description="as it was asked for", examples=["usual"])
    joints: tuple[JointCertificate, ...] = Field(description="joint by joint")
    checked_with: str = Field(description="what loaded the file back and computed its torques")
    not_measured: str | None = Field(
        default=None, description="why nothing loaded the file back here, and what would make it so"
    )
    remarks: tuple[str, ...] = Field(description="what the user of the file must know")
