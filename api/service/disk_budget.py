"""How full the disk of the experiments is: a warning before it binds, and what is refused once it does."""

import logging
import os
import shutil
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from api.service.problems import Problem

GIGABYTE = 1e9
WARN_AT = 0.8
"""Share of the budget from which it is warned."""
RESERVE = 1e9
"""Bytes that stay free on the disk whatever the budget: databases and logs are on it too."""
WARN_BELOW = 5 * RESERVE
"""Bytes free on the disk below which it is warned."""
LOOKED_AT_EVERY = 60.0
"""s between looks."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class DiskState:
    """What stands on the disk, in bytes; `budget` is None where only the disk itself bounds."""

    used: int
    free: int
    budget: int | None

    @property
    def full(self) -> bool:
        """Whether nothing more is taken in."""
        return self.free < RESERVE or (self.budget is not None and self.used >= self.budget)

    @property
    def warning(self) -> str | None:
        """What a person should know, one sentence; None while there is room."""
        if self.budget is not None and self.used >= WARN_AT * self.budget:
            sentence = f"{self.used / GIGABYTE:.3g} of {self.budget / GIGABYTE:.3g} GB that experiments may take are used"
        elif self.free < WARN_BELOW:
            sentence = f"the disk has {self.free / GIGABYTE:.3g} GB free"
        else:
            return None
        if self.full:
            return f"{sentence}; no session and no upload is taken until something is moved away"
        return f"{sentence}; sessions and uploads are refused once it is full"


class DiskBudget:
    """Looks at the disk from time to time, and says once in the log when it becomes tight.

    folder : the data folder
    budget : bytes that it may take; None for as many as the disk has beside its reserve
    """

    def __init__(
        self,
        folder: Path,
        budget: int | None,
        free: Callable[[Path], int] = lambda folder: shutil.disk_usage(folder).free,
    ) -> None:
        self._folder = folder
        self._budget = budget
        self._free = free
        self._ended = threading.Event()
        self._warned: str | None = None
        self.state = self.look()

    def look(self) -> DiskState:
        """Count what there is now."""
        used = _size(self._folder) if self._budget is not None else 0
        self.state = DiskState(used, self._free(self._folder), self._budget)
        kind = None if self.state.warning is None else ("full" if self.state.full else "tight")
        if kind is not None and kind != self._warned:
            _log.warning("disk: %s", self.state.warning)
        self._warned = kind
        return self.state

    def require_room(self, coming: int = 0) -> None:
        """Raises the problem 507 where the disk or the budget is full, or would be with `coming` bytes more."""
        state = DiskState(self.state.used + coming, self._free(self._folder) - coming, self._budget)
        if state.full:
            raise Problem(507, f"There is no room: {state.warning}.")

    def start(self) -> None:
        """Look from time to time, in a thread of its own."""
        threading.Thread(target=self._watch, name="disk-budget", daemon=True).start()

    def close(self) -> None:
        """Look no more."""
        self._ended.set()

    def _watch(self) -> None:
        while not self._ended.wait(LOOKED_AT_EVERY):
            try:
                self.look()
            except OSError:
                _log.exception("disk: cannot be looked at")


def _size(folder: Path) -> int:
    """Bytes of all files below a folder, as they are on the disk."""
    total, pending = 0, [folder]
    while pending:
        try:
            with os.scandir(pending.pop()) as entries:
                for entry in entries:
                    if entry.is_dir(follow_symlinks=False):
                        pending.append(Path(entry.path))
                    else:
                        total += entry.stat(follow_symlinks=False).st_size
        except FileNotFoundError:
            continue
    return total
