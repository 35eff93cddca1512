"""A description that the diagnosis offers becomes an effect of the experiment by one call, and goes as any other does."""

import pytest

from api.service.problems import Problem
from identify.results.diagnosis import DiagnosisDocument, JointDiagnosis, Learned

FILE = """\
name: learned-position-j1
columns: ["max(0, q - edge)**1.5"]
constants:
  edge: {from: 0.4, to: 0.8, count: 3}
explanation: Learned from the record.
source: learned from the record
unit: N m/(rad)^1.5
variable: q
"""


def offer(name: str) -> DiagnosisDocument:
    """A diagnosis of one joint with a description over its position."""
    learned = Learned(
        effect=name,
        variables=("q",),
        form="2.1 * max(0, q - 0.6)**1.5",
        knots=((-1.0, 0.0, 1.0),),
        values=(0.0, 0.0, 0.5),
        deviations=(0.0, 0.0, 0.1),
        unit="N m",
        relative_error_before=0.05,
        relative_error_after=0.03,
        p_value=1e-9,
        explanation="Learned from the record.",
        file=FILE.replace("learned-position-j1", name),
    )
    joint = JointDiagnosis(
        joint="j1",
        verdict="unexplained",
        missing=(),
        candidates=(),
        evidence=(),
        where=(),
        noise_floor=None,
        structure=(),
        superfluous=(),
        learned=learned,
    )
    return DiagnosisDocument(
        experiment="pendulum",
        model="usual",
        relative_error=0.05,
        relative_error_with_missing=0.05,
        noise_floor=None,
        joints=(joint,),
        not_applicable=(),
    )


def test_what_is_offered_is_added_kept_and_removed(imported, service, finished) -> None:
    client, experiment = imported
    models = service.service.models

    def ended(job) -> dict:
        return finished(client, {"id": job.id, "state": "queued"})

    with pytest.raises(Problem, match="offers no description for joint j1"):
        models.add_learned(experiment, "ada", "j1")
    story = models.story(experiment)
    story.store_diagnosis("m1", offer("learned-position-j1"))
    page = client.get(f"/pages/experiments/{experiment}/missing", headers={"Accept": "text/html"}).text
    assert "2.1 * max(0, q - 0.6)**1.5" in page
    assert page.count('<circle cx="') >= 3  # the support points
    job = client.post(
        f"/pages/experiments/{experiment}/steps/add-learned?joint=j1", headers={"Accept": "text/html"}
    )
    assert job.status_code == 200, job.text
    active = service.service.jobs.active(experiment)
    assert ended(active)["state"] == "done"
    current = story.read().current
    assert current.add == ["learned-position-j1@j1"]
    assert "max(0, q - edge)" in (story.folder.parent / "learned-position-j1.yaml").read_text()
    # The sessions are what they were: no fit is of other data now.
    assert not models.results(experiment).stale
    assert story.read().version("m1").fit.data == current.fit.data
    evidence = client.get(f"/pages/experiments/{experiment}/missing", headers={"Accept": "text/html"}).text
    assert "Remove learned-position-j1" in evidence
    assert "Residual over position" in evidence

    models.undo(experiment, "ada")
    again = models.add_learned(experiment, "ada", "j1")  # the file is there already, and is the same
    service.service.jobs.cancel(again.id)
