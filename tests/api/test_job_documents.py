"""What came of a job, as a document: as it is told, and as older versions stored it."""

from api.service.job_documents import JobResult
from identify.results.improvement import ImprovementDocument

IMPROVEMENT = ImprovementDocument(experiment="arm", model="usual", steps=(), verdict="adequate")


def test_only_what_there_is_is_told():
    assert JobResult(plan="slow").model_dump(mode="json") == {"plan": "slow"}
    assert JobResult().model_dump_json() == "{}"


def test_an_improvement_is_told_whole_and_read_again_whatever_version_wrote_it():
    stored = JobResult(model="m2", improvement=IMPROVEMENT).model_dump(mode="json", by_alias=True)
    assert stored["improvement"] == IMPROVEMENT.to_json()
    assert JobResult.model_validate(stored).improvement == IMPROVEMENT
    del stored["improvement"]["format"]  # as before documents had types
    assert JobResult.model_validate(stored).improvement == IMPROVEMENT


def test_of_an_improvement_that_cannot_be_read_the_rest_of_the_result_is_left():
    stored = {"model": "m2", "improvement": {"format": 99}}
    assert JobResult.model_validate(stored) == JobResult(model="m2")
