"""Sessions of an experiment, as the routes describe, weigh and recover them."""

import h5py

from tests.api.rig_session import RIG, STEPS, operator, prepare, take, watch

__all__ = ["operator"]


def test_without_a_scale_the_operator_is_told_to_type_the_mass(operator):
    prepare(operator)
    answer = take(operator, "session-00", "weigh")
    assert answer.status_code == 409
    assert "type the mass" in answer.json()["detail"]


def test_a_payload_of_ones_own_is_taken_and_one_of_a_known_name_but_another_mass_is_not(operator):
    new = {"rig": RIG, "plan": "short", "payload": {"name": "brick", "mass": 2.5, "com": [1.2, 0, 0]}}
    assert operator.post("/experiments/arm/sessions", json=new).json()["payload"]["mass"] == 2.5
    new["payload"] = {"name": "disk-7", "mass": 2.5}
    answer = operator.post("/experiments/arm/sessions", json=new)
    assert answer.status_code == 422
    assert "another payload disk-7" in answer.json()["detail"]
    new["payload"] = {"name": "unknown"}
    assert operator.post("/experiments/arm/sessions", json=new).status_code == 422


def test_a_recording_whose_process_died_is_recovered_with_what_it_had(operator, service, data_folder):
    prepare(operator)
    take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    watch(operator)
    folder = service.service.experiments.folder("arm")
    # As after a power cut: an open recording that nobody closed.
    incomplete = folder / "incomplete" / "session-01.h5"
    with h5py.File(folder / "session-00.h5") as whole, h5py.File(incomplete, "w", libver="latest") as cut:
        for name, value in whole.attrs.items():
            cut.attrs[name] = value
        cut.attrs["status"] = "recording"
        for name, column in whole.items():
            cut.create_dataset(name, data=column[:3000])
            for key, value in column.attrs.items():
                cut[name].attrs[key] = value
    service.service.experiments.reindex()
    assert operator.get("/experiments/arm/sessions/session-01").json()["state"] == "recording"
    recovered = operator.post("/experiments/arm/sessions/session-01/recover").json()
    assert recovered["state"] == "aborted"
    assert "recovered by the-operator" in recovered["reason"]
    assert operator.get("/experiments/arm/recordings/session-01").status_code == 200
    assert operator.post("/experiments/arm/sessions/session-01/recover").status_code == 409
