"""What the service says in its log: each message on a line of its own, and so many of one kind in a minute.

Whatever can be sent to a service can be sent a million times: a line for each of them fills the disk. And what is quoted of
what was sent must not begin a line that looks like one of ours, nor command the terminal that shows it.
"""

import copy
import logging
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

from uvicorn.config import LOGGING_CONFIG
from uvicorn.logging import DefaultFormatter

from identify.recording.errors import one_line

MOST_OF_A_KIND = 20
"""messages of one place in the program that are written in a minute; the others are counted"""
MINUTE = 60.0
_FORMAT = LOGGING_CONFIG["formatters"]["default"]["fmt"]


@dataclass
class _Kind:
    since: float
    count: int = 0


class BoundedKinds(logging.Filter):
    """Lets so many messages of each place in the program through in a minute; the first after it says how many were left out."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock = clock
        self._kinds: dict[tuple[str, int], _Kind] = {}
        self._counting = Lock()

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether it is written."""
        with self._counting:
            now = self._clock()
            kind = self._kinds.setdefault((record.pathname, record.lineno), _Kind(now))
            left_out = 0
            if now - kind.since >= MINUTE:
                left_out = max(0, kind.count - MOST_OF_A_KIND)
                kind.since, kind.count = now, 0
            kind.count += 1
            count = kind.count
        if left_out:
            _append(record, f" ({left_out} more of this kind were left out before)")
        if count == MOST_OF_A_KIND:
            _append(record, " (more of this kind within a minute are counted, not written)")
        return count <= MOST_OF_A_KIND


def _append(record: logging.LogRecord, addition: str) -> None:
    record.msg, record.args = record.getMessage() + addition, None


class OneLine(DefaultFormatter):
    """A message takes one line, and every line of a traceback is indented; characters that are not shown are written as codes."""

    def format(self, record: logging.LogRecord) -> str:
        """The text of a message."""
        record = copy.copy(record)
        record.msg, record.args = one_line(record.getMessage()), None
        record.__dict__.pop("color_message", None)
        return "\n    ".join(one_line(line) for line in super().format(record).split("\n"))


class BoundedHandler(logging.StreamHandler):
    """Writes to the standard error output, as it is then."""

    def __init__(self) -> None:
        super().__init__(sys.stderr)
        self.setFormatter(OneLine(_FORMAT, use_colors=False))
        self.addFilter(BoundedKinds())

    def emit(self, record: logging.LogRecord) -> None:
        """Write a message."""
        self.stream = sys.stderr
        super().emit(record)


UVICORN_LOG = {
    **LOGGING_CONFIG,
    "handlers": {**LOGGING_CONFIG["handlers"], "default": {"()": "api.bounded_log.BoundedHandler"}},
}
"""What uvicorn is told about its log."""


def log_everything_bounded() -> None:
    """Everything else that this process logs goes the same way."""
    logging.getLogger().addHandler(BoundedHandler())
