"""Excitation plans as files: made for a rig, kept, and taken by id for a session."""

import re
from pathlib import Path

from pydantic import ValidationError

from api.service.plan_documents import SeparatingPlanReport, StoredPlanReport, StoredReport
from api.service.problems import not_found
from daq.excitation.excitation_plan import ExcitationPlan
from identify.recording.atomic_file import write_atomically
from identify.recording.errors import InputError
from identify.recording.first_fault import first_fault

REPORTS = "reports"
"""Folder within that of the plans for what was found when they were made."""
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

    def file(self, identifier: str) -> Path:
        """The file of a plan. Raises the problem 404."""
        if identifier not in self.ids():
            raise not_found("plan", identifier)
        return self._folder / f"{identifier}.json"

    def plan(self, identifier: str) -> ExcitationPlan:
        """The plan with that id. Raises the problem 404, and InputError if its file was damaged."""
        file = self.file(identifier)
        try:
            return ExcitationPlan.load(file)
        except InputError as error:
            raise InputError(str(error).replace(f"{self._folder}/", "")) from error

    def report(self, identifier: str) -> StoredPlanReport | SeparatingPlanReport | None:
        """What the plan will tell about its model and what it cannot, as found when it was made; else None.

        Raises the problem 404, and InputError if the file was damaged.
        """
        if identifier not in self.ids():
            raise not_found("plan", identifier)
        file = self._folder / REPORTS / f"{identifier}.json"
        try:
            return StoredReport.model_validate_json(file.read_bytes()).root
        except FileNotFoundError:
            return None
        except ValidationError as error:
            raise InputError(f"{REPORTS}/{file.name}: {first_fault(error)}") from error

    def separating_report(self, identifier: str) -> SeparatingPlanReport | None:
        """The report on a plan that was made to tell effects apart; None for any other. Raises as `report`."""
        report = self.report(identifier)
        return report if isinstance(report, SeparatingPlanReport) else None

    def add(self, plan: ExcitationPlan, report: StoredPlanReport | SeparatingPlanReport | None = None) -> str:
        """Store a plan under an id made from its name, with the report on it; returns the id."""
        wanted = re.sub(r"[^a-z0-9]+", "-", plan.name.lower()).strip("-")[:50] or "plan"
        taken = set(self.ids())
        numbered = (wanted if number == 1 else f"{wanted}-{number}" for number in range(1, len(taken) + 2))
        identifier = next(each for each in numbered if each not in taken)
        (self._folder / REPORTS).mkdir(parents=True, exist_ok=True)
        if report is not None:
            text = report.model_dump_json(by_alias=True)
            write_atomically(self._folder / REPORTS / f"{identifier}.json", text.encode())
        write_atomically(self._folder / f"{identifier}.json", plan.to_json().encode())
        return identifier
