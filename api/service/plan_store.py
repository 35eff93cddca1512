"""Excitation plans as files: made for a rig, kept, and taken by id for a session."""

import json
import re
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from api.service.problems import not_found
from daq.excitation.excitation_plan import ExcitationPlan
from identify.recording.atomic_file import write_atomically
from identify.recording.errors import InputError
from identify.results.document import Json

REPORTS = "reports"
"""Folder within that of the plans for what was found when they were made."""
PLAN_ID = re.compile(r"[a-z0-9][a-z0-9_.-]{0,63}")


class PlanPurpose(BaseModel):
    """What a plan was made to tell apart."""

    model_config = ConfigDict(frozen=True)

    rivals: tuple[str, ...]
    """names of the effects"""
    joint: str
    payload: str
    """the one to mount"""
    separation: float | None
    """standard deviations between them that are expected"""
    decides: bool
    """whether that is enough"""


class SeparatingPlanReport(BaseModel):
    """The report on a plan that was made to tell effects apart."""

    model_config = ConfigDict(frozen=True)

    purpose: PlanPurpose
    remarks: tuple[str, ...] = ()
    """what the rig's limits made of the motion"""


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

    def report(self, identifier: str) -> Json | None:
        """What the plan will tell about its model and what it cannot, as found when it was made; else
        None.
        """
        if identifier not in self.ids():
            raise not_found("plan", identifier)
        try:
            return json.loads((self._folder / REPORTS / f"{identifier}.json").read_bytes())
        except FileNotFoundError:
            return None

    def separating_report(self, identifier: str) -> SeparatingPlanReport | None:
        """The report on a plan that was made to tell effects apart; None for any other. Raises the problem 404."""
        report = self.report(identifier)
        return SeparatingPlanReport.model_validate(report) if report and "purpose" in report else None

    def add(self, plan: ExcitationPlan, report: Json | SeparatingPlanReport | None = None) -> str:
        """Store a plan under an id made from its name, with the report on it; returns the id."""
        wanted = re.sub(r"[^a-z0-9]+", "-", plan.name.lower()).strip("-")[:50] or "plan"
        taken = set(self.ids())
        numbered = (wanted if number == 1 else f"{wanted}-{number}" for number in range(1, len(taken) + 2))
        identifier = next(each for each in numbered if each not in taken)
        (self._folder / REPORTS).mkdir(parents=True, exist_ok=True)
        if isinstance(report, SeparatingPlanReport):
            report = report.model_dump(mode="json")
        if report is not None:
            write_atomically(self._folder / REPORTS / f"{identifier}.json", json.dumps(report).encode())
        write_atomically(self._folder / f"{identifier}.json", plan.to_json().encode())
        return identifier
