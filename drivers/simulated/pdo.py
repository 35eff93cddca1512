"""A PDO of a simulated drive as its communication and mapping objects stand (CiA 301 sections 7.5.2.35 to 7.5.2.38)."""

from collections.abc import Sequence

from drivers.simulated.process_image import MappedSlots

PDO_OFF = 1 << 31
"""In the COB-ID: the PDO does not exist."""
LAST_SYNCHRONOUS = 240
"""Transmission types up to this one go with SYNC."""


class Pdo:
    """One PDO, and what is on its way in it."""

    def __init__(self) -> None:
        self.can_id = 0
        self.valid = False
        self.transmission_type = 255
        self.slots: MappedSlots | None = None
        self.received: bytes | None = None  # RPDO waiting for SYNC
        self.event_time = 0.0  # s, of an RPDO: after so long without one the drive reacts; 0 for never
        self.silent_for: float | None = None  # s since an RPDO came; None before the first
        self.last_sent: bytes | None = None  # event-driven TPDO
        self.syncs = 0

    @property
    def synchronous(self) -> bool:
        """Whether it goes with SYNC."""
        return self.transmission_type <= LAST_SYNCHRONOUS

    def take(self, data: bytes) -> None:
        """An RPDO came."""
        self.received = data if self.synchronous else None
        self.silent_for = 0.0

    def missed_after(self, duration: float) -> bool:
        """Whether, `duration` s on, an RPDO has been missed for its event time: once, then it is waited for again."""
        if not self.event_time or self.silent_for is None:
            return False
        self.silent_for += duration
        if self.silent_for <= self.event_time:
            return False
        self.silent_for = None
        return True

    def load(self, cob_id: int, transmission_type: int, slots: Sequence[tuple[int, str]]) -> None:
        """Take over what its objects say; what was on its way is gone.

        slots : of the process image, with formats, in the order of the mapping
        """
        self.can_id = cob_id & 0x7FF
        self.transmission_type = transmission_type
        self.received = None
        self.silent_for = None
        self.last_sent = None
        self.syncs = 0
        self.slots = MappedSlots(list(slots)) if slots else None
        self.valid = not cob_id & PDO_OFF and self.slots is not None
