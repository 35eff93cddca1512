"""What can go wrong between us and the hardware, in words that an operator can act on."""

import errno
import os


class DriverError(Exception):
    """A bus, a drive or a scale did not do what was asked; the message is one sentence for the operator."""


class BusError(DriverError):
    """The CAN interface cannot be opened or used: not there, no permission, down, or not installed."""


class DriveError(DriverError):
    """A drive answered something else than was asked, or not at all.

    node      : CANopen node id
    index     : object concerned, e.g. 0x6041, or None
    subindex  : its subindex
    expected  : what should have come, in words
    received  : what came, in words
    """

    def __init__(
        self,
        node: int,
        doing: str,
        *,
        index: int | None = None,
        subindex: int = 0,
        expected: str = "",
        received: str = "",
    ):
        self.node = node
        self.doing = doing
        self.index = index
        self.subindex = subindex
        self.expected = expected
        self.received = received
        where = f" (object {self.where})" if self.where else ""
        wanted = f": expected {expected}" if expected else ""
        came = f"; {received}" if received and wanted else f": {received}" if received else ""
        super().__init__(f"node {node}: {doing}{where}{wanted}{came}")

    @property
    def where(self) -> str:
        """The object concerned, as manuals write it; "" where none is."""
        return "" if self.index is None else f"0x{self.index:04X}:{self.subindex:02X}"

    def with_cause(self, cause: str) -> "DriveError":
        """The same with what is behind it, in words."""
        return DriveError(
            self.node,
            self.doing,
            index=self.index,
            subindex=self.subindex,
            expected=self.expected,
            received=f"{self.received}; {cause}" if self.received else cause,
        )


class ScaleError(DriverError):
    """The weighing scale refused, did not answer, or shows a weight that must not be used."""


_REASONS = {
    errno.EACCES: "no permission; is this user in the group that owns the device?",
    errno.EPERM: "no permission; is this user in the group that owns the device?",
    errno.ENODEV: "the channel is not there",
    errno.ENXIO: "the channel is not there",
    errno.ENOENT: "the channel is not there",
    errno.ENETDOWN: "the channel is down: the interface was switched off, unplugged, or went bus off; bring it up again",
    errno.ENETUNREACH: "the channel's network cannot be reached",
    errno.ENOBUFS: "its queue of frames to send is full: nobody acknowledges them (no drive with power, wiring, termination, "
    "bit rate), or the bus is at its load limit",
    errno.EAGAIN: "it takes no further frame: nobody acknowledges those before, or the bus is at its load limit",
    errno.EIO: "the adapter does not answer; is it unplugged?",
    errno.EBUSY: "somebody else uses it",
    errno.EBADF: "it was closed meanwhile",
}
"""By number of the operating system's error: what has happened, and what to look at."""


def reason_in_words(error: BaseException) -> str:
    """The reason behind an error of python-can or the operating system, in our own words as far as it can be told."""
    number = next(
        (
            number
            for each in (error, error.__cause__, error.__context__)
            if (number := getattr(each, "errno", None) or getattr(each, "error_code", None))
        ),
        None,
    )
    if number in _REASONS:
        return _REASONS[number]
    if isinstance(number, int) and isinstance(error, OSError):
        return os.strerror(number)
    return " ".join(str(error).split()) or type(error).__name__
