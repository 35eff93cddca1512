"""Plans as files: ids made of names, the newest first, what is damaged is named."""

import os

import pytest

from api.service.plan_documents import PlanPurpose, PredictedCurrents, SeparatingPlanReport, StoredPlanReport
from api.service.plan_store import PlanStore
from api.service.problems import Problem
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_report_document import RepeatedStretch
from daq.excitation.trapezoid import Dwell
from identify.recording.errors import InputError


def plan(name: str) -> ExcitationPlan:
    return ExcitationPlan(name=name, joints=("j1",), start=(0.0,), phases=(Dwell(duration=2.0),))


@pytest.fixture
def store(tmp_path) -> PlanStore:
    return PlanStore(tmp_path / "plans")


def test_a_plan_is_stored_under_a_plain_id_and_read_again(store):
    assert store.ids() == []
    assert store.add(plan("Slow Ramps, 60 s!")) == "slow-ramps-60-s"
    assert store.plan("slow-ramps-60-s") == plan("Slow Ramps, 60 s!")


def test_names_that_are_taken_are_numbered_and_empty_ones_called_plan(store):
    assert [store.add(plan("bench")) for _ in range(3)] == ["bench", "bench-2", "bench-3"]
    assert store.add(plan("¡!")) == "plan"
    assert len(store.add(plan("x" * 200))) == 50


def test_the_newest_comes_first_and_other_files_are_no_plans(store, tmp_path):
    for age, name in enumerate(("new", "older", "oldest")):
        store.add(plan(name))
        os.utime(tmp_path / "plans" / f"{name}.json", (1e9 - age, 1e9 - age))
    (tmp_path / "plans" / "Not An Id.json").write_text("{}")
    assert store.ids() == ["new", "older", "oldest"]


def report() -> StoredPlanReport:
    return StoredPlanReport(
        rig="bench",
        model="usual",
        criterion="d-optimal",
        payloads=("none",),
        seconds=2.0,
        repeated=(RepeatedStretch(begin=0.5, end=1.5, period=0.5),),
        loads="from assumed masses",
        noise=(),
        condition_number=None,
        parameters=(),
        inseparable=(("ZZ1R",),),
        cannot_tell=(),
        coverage=(),
        peak_current=(),
        remarks=(),
        predicted=PredictedCurrents(time=[0.0], currents=[]),
    )


def test_a_report_stands_beside_its_plan_or_there_is_none(store):
    store.add(plan("told"), report())
    store.add(plan("untold"))
    assert store.report("told") == report()
    assert store.report("untold") is None


def test_a_report_that_was_damaged_is_named_with_the_field(store, tmp_path):
    store.add(plan("told"), report())
    file = tmp_path / "plans" / "reports" / "told.json"
    file.write_text(file.read_text().replace('"seconds"', '"second"'))
    with pytest.raises(InputError, match=r"^reports/told\.json: .*seconds: Field required$"):
        store.report("told")


def test_the_report_on_a_plan_that_tells_effects_apart_is_read_as_it_was_stored(store):
    purpose = PlanPurpose(
        rivals=("backlash", "delay"), joint="j3", payload="disk", separation=4.2, decides=True
    )
    made = SeparatingPlanReport(purpose=purpose, remarks=("slower than proposed",))
    store.add(plan("told"), made)
    store.add(plan("other"), report())
    assert store.separating_report("told") == made
    assert store.separating_report("other") is None


@pytest.mark.parametrize("identifier", ["nothing", "../plans/told", ""])
def test_only_what_the_folder_lists_is_opened(store, identifier):
    store.add(plan("told"))
    for ask in (store.plan, store.report):
        with pytest.raises(Problem) as problem:
            ask(identifier)
        assert problem.value.status == 404


def test_a_damaged_file_is_named_without_the_folder(store, tmp_path):
    store.add(plan("told"))
    (tmp_path / "plans" / "told.json").write_text("{")
    with pytest.raises(InputError, match=r"told\.json") as error:
        store.plan("told")
    assert str(tmp_path) not in str(error.value)
