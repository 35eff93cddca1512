"""The client that a scientist uses from a notebook, against a service that really listens."""

import numpy as np
import pytest
import scipy.io

import identify
from api.client import Client, JobFailed, ServiceError
from api.service.accounts import Role
from api.service.record_documents import CanLogImport, Dialect, JointOfRecord, RecordImport

RIG = "rx130l-joint3-simulated"


@pytest.fixture
def coulomb(listening):
    token = listening.client(Role.OPERATOR).headers["Authorization"].removeprefix("Bearer ")
    with Client(listening.address, token, timeout=300.0) as client:  # a busy machine is no failure
        yield client


@pytest.fixture
def experiment(coulomb, tmp_path, write_measured_experiment, zipped):
    archive = tmp_path / "pendulum.zip"
    archive.write_bytes(zipped(write_measured_experiment(tmp_path / "measured")))
    imported = coulomb.import_experiment(archive)
    coulomb.wait(imported.job)
    return imported.experiment.id


def test_a_notebook_goes_from_data_to_a_better_model(coulomb, experiment, tmp_path):
    before = coulomb.results(experiment)
    assert before.model == "usual"
    said = []
    asked = coulomb.diagnose(experiment, "m1", motion=True)
    coulomb.wait(asked, lambda fraction, words: said.append((fraction, words)))
    assert said[-1] == (1.0, "done")
    diagnosis = coulomb.diagnosis(experiment, "m1")
    joint = diagnosis.joints[0]
    assert joint.verdict == "missing"
    assert {each.effect for each in diagnosis.motion} == set(joint.missing)
    coulomb.wait(coulomb.add_effect(experiment, joint.missing[0], joint.joint))
    after = coulomb.results(experiment)
    assert after.relative_error < 0.1 * before.relative_error
    assert coulomb.compare(experiment, "m1", "m2").relative_error_change < 0
    assert coulomb.undo(experiment).version.id == "m1"
    assert coulomb.redo(experiment).version.id == "m2"
    assert coulomb.models(experiment).line == ["m1", "m2"]
    assert coulomb.model(experiment, "m2").version.parent == "m1"
    coulomb.wait(coulomb.remove_effect(experiment, joint.missing[0], joint.joint))
    assert coulomb.results(experiment).relative_error == pytest.approx(before.relative_error)


def test_signals_come_as_arrays(coulomb, experiment, tmp_path):
    path = coulomb.download(experiment, "session-00", tmp_path / "copy.csv")
    recorded = np.genfromtxt(path, delimiter=",", skip_header=1)
    coulomb.download(experiment, "session-00", tmp_path / "copy.mat", "mat")
    np.testing.assert_array_equal(scipy.io.loadmat(tmp_path / "copy.mat")["q1"][:, 0], recorded[:, 1])
    time, signals = coulomb.recorded_signals(experiment, "session-00", points=20_000)
    np.testing.assert_allclose(time, recorded[:, 0], atol=1e-6)
    np.testing.assert_allclose(signals["position"], recorded[:, 1], rtol=1e-6)
    time, signals = coulomb.model_signals(experiment, "m1", "session-00", start=5.0, end=6.0)
    assert set(signals) == {"measured", "predicted", "error", "position", "velocity", "load"}
    assert 4.9 < time[0] < 5.1
    np.testing.assert_allclose(signals["error"], signals["measured"] - signals["predicted"], atol=1e-3)
    with pytest.raises(FileExistsError):
        coulomb.download(experiment, "session-00", path)


def test_refusals_are_exceptions_with_the_services_words(coulomb, experiment):
    with pytest.raises(ServiceError, match="No experiment has the id `none`") as refused:
        coulomb.results("none")
    assert refused.value.status == 404
    with pytest.raises(ServiceError, match="not in the catalogue"):
        coulomb.add_effect(experiment, "magic")
    job = coulomb.make_plan(RIG, "hasty", seconds=1.0)
    with pytest.raises(JobFailed, match="plan: failed"):
        coulomb.wait(job)


def test_a_cookie_that_an_answer_brings_does_not_stand_in_the_way_of_a_change(listening):
    with Client(listening.address) as client:
        assert client._http.get("/pages/rig", headers={"Accept": "text/html"}).headers.get("set-cookie")
        assert client.create_experiment("after a cookie", RIG).id == "after-a-cookie"


def test_the_catalogue_is_the_identifiers_own(coulomb):
    assert [effect.effect for effect in coulomb.effects()] == [entry.effect for entry in identify.catalogue()]


def test_a_session_is_measured_from_a_notebook(coulomb, tmp_path):
    plan = coulomb.wait(coulomb.make_plan(RIG, "short", seconds=20, model="usual")).result.plan
    experiment = coulomb.create_experiment("arm", RIG).id
    session = coulomb.create_session(experiment, RIG, plan, "none").id
    coulomb.step(experiment, session, "weigh", mass=0.0)
    assert coulomb.step(experiment, session, "check").ok
    for step in ("confirm", "arm", "start"):
        coulomb.step(experiment, session, step)
    assert coulomb.stop(RIG) is True
    assert coulomb.rig(RIG).status.session.id == session
    assert coulomb.session(experiment, session).rig == RIG


def test_other_peoples_records_and_logs_become_experiments(coulomb, tmp_path):
    time = np.arange(400) / 200
    columns = np.column_stack([time, np.sin(3 * time), np.cos(2 * time)])
    np.savetxt(tmp_path / "run.csv", columns, delimiter=";", header="t [s];q [rad];i [A]", comments="")
    [described] = coulomb.describe_records([tmp_path / "run.csv"], Dialect(separator="semicolon"))
    assert (described.time, described.position, described.command) == ("t [s]", ["q [rad]"], ["i [A]"])
    joint = JointOfRecord(position=described.position[0], command=described.command[0], gain=2.0)
    wanted = RecordImport(name="bench", joints=[joint], time=["t [s]"], gravity=(0.0, -9.81, 0.0))
    made = coulomb.import_records([tmp_path / "run.csv"], wanted)
    assert made.experiment.name == "bench"
    added = coulomb.import_records(
        [tmp_path / "run.csv"], wanted.model_copy(update={"experiment": made.experiment.id})
    )
    assert added.experiment.id == made.experiment.id
    assert len(coulomb.recordings(made.experiment.id)) == 2
    (tmp_path / "bus.log").write_text("(0.000000) can0 183#0000000000003712\n")
    with pytest.raises(ServiceError, match="holds no SYNC"):
        coulomb.import_can_logs([tmp_path / "bus.log"], CanLogImport(rig=RIG))


def test_a_demo_is_begun_and_broken_off(coulomb):
    job = coulomb.start_demo()
    assert job.kind == "demo"
    assert coulomb.cancel(job.id).id == job.id
    assert [each.id for each in coulomb.jobs()] == [job.id]
    with pytest.raises(JobFailed, match="demo: cancelled"):
        coulomb.wait(job)
    assert coulomb.experiments() == []
