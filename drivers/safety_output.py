"""An output that takes the drives' power away by another way than the drives themselves: a relay, a CAN I/O module.

It is one means more, not a safety function: what a person relies on is the emergency stop, wired without software.
"""

import os
from collections.abc import Callable
from pathlib import Path
from string import hexdigits
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from drivers.errors import BusError

Send = Callable[[int, bytes], None]
FRAME_BYTES = 8
"""that a frame of classic CAN holds at most"""


class SafetyOutputSettings(BaseModel):
    """Either bytes that are written to a device or file, or a CAN frame; the section `safety_output` of a rig file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    path: str | None = Field(
        default=None,
        description="device or file: a serial relay (/dev/ttyUSB0), a GPIO line (/sys/class/gpio/gpio17/value)",
    )
    write: str = Field(
        default="",
        description="bytes in hexadecimal digits that take the power away",
    )
    can_id: int | None = Field(default=None, ge=1, le=0x7FF, description="of a frame for a CAN I/O module")
    data: str = Field(default="", max_length=2 * FRAME_BYTES, description="of that frame, hexadecimal digits")

    @field_validator("write", "data")
    @classmethod
    def _bytes(cls, digits: str) -> str:
        if len(digits) % 2 or not set(digits) <= set(hexdigits):
            raise ValueError(
                "give bytes as pairs of hexadecimal digits (0 to 9, A to F) without spaces, such as A00101A2"
            )
        return digits

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.path is None) == (self.can_id is None):
            raise ValueError("name either `path` (with `write`) or `can_id` (with `data`)")
        if self.path is not None and not self.write:
            raise ValueError("write: which bytes take the power away is not said")
        return self


class SafetyOutput:
    """The output, opened beforehand: to use it needs no new file.

    send : puts a frame on the bus

    Raises BusError where the device cannot be opened.
    """

    def __init__(self, settings: SafetyOutputSettings, send: Send) -> None:
        self.settings = settings
        self._send = send
        self._descriptor: int | None = None
        if settings.path is not None:
            try:
                self._descriptor = os.open(settings.path, os.O_WRONLY | os.O_NOCTTY | os.O_NONBLOCK)
            except OSError as error:
                raise BusError(
                    f"safety_output: {Path(settings.path)} cannot be opened ({error.strerror}); is the device there, "
                    "and may this user write to it?"
                ) from error

    def cut(self) -> None:
        """Take the power away. Raises BusError where the output refuses."""
        settings = self.settings
        if self._descriptor is None:
            assert settings.can_id is not None
            self._send(settings.can_id, bytes.fromhex(settings.data))
            return
        try:
            os.write(self._descriptor, bytes.fromhex(settings.write))
        except OSError as error:
            raise BusError(f"safety_output: {settings.path} refused ({error.strerror})") from error

    def close(self) -> None:
        """Close the device; harmless when repeated."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
