"""Excitation plans as files: made for a rig, kept, and taken by id for a session."""

import re
from pathlib import Path

from api.service.atomic_file import write_atomically
from api.service.problems import not_found
from daq.excitation.excitation_plan import ExcitationPlan
from identify.recording.errors import InputError

PLAN_ID = re.compile(r"[a-z0-9][a-z0-9_.-]{0,63}")


class PlanStore:
    """Plans in one folder, `<id>.json` each. Ids come from the index of the folder, never from a request."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def ids(self) -> list[str]:
        """Ids of all plans, the newest first."""
        if not self._folder.is_dir():
            return []
        files = sorted(self._folder.glob("*.json"), key=lambda file: file.stat().st_mtime, reverse=True)
        return [file.stem for file in files if PLAN_ID.fullmatch(file.stem)]

    def plan(self, identifier: str) -> ExcitationPlan:
        """The plan with that id. Raises the problem 404, and InputError if its file was damaged."""
        if identifier not in self.ids():
            raise not_found("plan", identifier)
        file = self._folder / f"{identifier}.json"
        try:
            return ExcitationPlan.load(file)
        except InputError as error:
            raise InputError(str(error).replace(f"{self._folder}/", "")) from error

    def add(self, plan: ExcitationPlan) -> str:
        """Store a plan under an id made from its name; returns the id."""
        wanted = re.sub(r"[^a-z0-9]+", "-", plan.name.lower()).strip("-")[:50] or "plan"
        taken = set(self.ids())
        numbered = (wanted if number == 1 else f"{wanted}-{number}" for number in range(1, len(taken) + 2))
        identifier = next(each for each in numbered if each not in taken)
        self._folder.mkdir(parents=True, exist_ok=True)
        write_atomically(self._folder / f"{identifier}.json", plan.to_json().encode())
        return identifier
