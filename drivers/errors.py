"""What can go wrong between us and the hardware, in words that an operator can act on."""


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
        where = "" if index is None else f" (object 0x{index:04X}:{subindex:02X})"
        wanted = f": expected {expected}" if expected else ""
        came = f"; {received}" if received and wanted else f": {received}" if received else ""
        super().__init__(f"node {node}: {doing}{where}{wanted}{came}")


class ScaleError(DriverError):
    """The weighing scale refused, did not answer, or shows a weight that must not be used."""
