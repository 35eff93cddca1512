"""Recordings as they are downloaded and plotted."""

import gzip
import io

import h5py
import numpy as np

import identify
from api.service.accounts import Role
from api.service.envelope import envelope
from tests.api.rig_session import STEPS, operator, prepare, take, watch

__all__ = ["operator"]


def test_recordings_are_downloaded_as_hdf5_csv_and_raw_frames(operator, service):
    prepare(operator)
    take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    watch(operator)
    listed = operator.get("/experiments/arm/recordings").json()
    assert listed[0]["formats"] == ["original", "csv", "mat", "parquet", "hdf5-si", "hdf5", "raw"]
    folder = service.service.experiments.folder("arm")
    address = "/experiments/arm/recordings/session-00"
    assert operator.get(address, params={"format": "hdf5"}).content == (folder / "session-00.h5").read_bytes()
    raw = gzip.decompress((folder / "session-00.log.gz").read_bytes())
    assert operator.get(address, params={"format": "raw"}).content == raw
    assert raw.endswith(b"\n")
    lines = operator.get(address, params={"format": "csv"}).text.splitlines()
    assert lines[0] == "t,q1,v1"
    with h5py.File(folder / "session-00.h5") as recording:
        counts, command = recording["position"], recording["command"]
        assert len(lines) == 1 + len(counts) > 4001  # written in blocks of 2000
        every = counts[:] @ counts.attrs["matrix"].T + counts.attrs["offset"]
        np.testing.assert_allclose([float(line.split(",")[1]) for line in lines[1:]], every[:, 0], rtol=1e-12)
        q = counts[100] @ counts.attrs["matrix"].T + counts.attrs["offset"]
        v = command[100] * command.attrs["scale"]
        t = (recording["sync_time"][100] - recording["sync_time"][0]) * 1e-9
    np.testing.assert_allclose(np.array(lines[101].split(","), float), [t, q[0], v[0]], rtol=1e-12, atol=1e-9)
    in_si = h5py.File(io.BytesIO(operator.get(address, params={"format": "hdf5-si"}).content))
    assert in_si["q1"].attrs["unit"] == "rad"
    np.testing.assert_allclose([in_si[name][100] for name in ("t", "q1", "v1")], [t, q[0], v[0]], rtol=1e-12)


def test_plotted_torque_is_the_identifiers_own(imported, service):
    client, experiment = imported
    answer = client.get(
        f"/experiments/{experiment}/models/m1/signals", params={"session": "session-01", "points": 20000}
    )
    names = answer.headers["X-Columns"].split(",")
    values = np.frombuffer(answer.content, "<f4").reshape(len(names), -1)
    folder = service.service.experiments.folder(experiment)
    own = identify.identify(identify.load_experiment(folder)).prediction("session-01.csv", "j1")
    np.testing.assert_allclose(values[names.index("measured")], own.measured, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(values[names.index("predicted")], own.predicted, rtol=1e-5, atol=1e-5)
    # The error is what the model lacks: positive where more was measured than predicted.
    np.testing.assert_allclose(values[names.index("error")], own.residual, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(values[names.index("velocity")], own.velocity, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(
        values[0] + float(answer.headers["X-Time-Origin"]), own.time, rtol=0, atol=1e-5
    )


def test_a_part_of_a_recording_is_plotted_with_no_more_rows_than_asked_for(imported, service):
    client, experiment = imported
    answer = client.get(
        f"/experiments/{experiment}/recordings/session-00/signals",
        params={"from": 5.0, "to": 15.0, "points": 100},
    )
    origin = float(answer.headers["X-Time-Origin"])
    values = np.frombuffer(answer.content, "<f4").reshape(3, -1)
    assert values.shape[1] <= 100
    assert origin <= 5.0 <= origin + values[0, 1]
    recorded = np.genfromtxt(
        service.service.experiments.folder(experiment) / "session-00.csv", delimiter=",", skip_header=1
    )
    inside = (recorded[:, 0] >= 4.998) & (recorded[:, 0] <= 15.002)
    _, expected = envelope(recorded[inside, 0], {"q": recorded[inside, 1]}, 100)
    assert values[1].min() == expected[1].min()
    assert values[1].max() == expected[1].max()


def test_what_a_recording_cannot_be_had_as_is_said_and_each_joint_is_counted_from_one(
    start_service, data_folder, write_measured_experiment
):
    folder = write_measured_experiment(data_folder / "experiments" / "pendulum", seconds=1.0)
    client, experiment = start_service().client(Role.VIEWER), "pendulum"
    address = f"/experiments/{experiment}/recordings"
    listed = client.get(address).json()
    assert [(each["session"], each["bytes"]) for each in listed] == [
        (name, (folder / f"{name}.csv").stat().st_size) for name in ("session-00", "session-01")
    ]
    assert listed[0]["formats"] == ["original", "csv", "mat", "parquet", "hdf5-si"]
    for wanted in ("hdf5", "raw"):
        refused = client.get(f"{address}/session-00", params={"format": wanted})
        assert refused.status_code == 409
        assert f"session-00 has no {wanted}: it is session-00.csv" in refused.json()["detail"]
    own = client.get(f"{address}/session-00", params={"format": "csv"})
    assert own.headers["Content-Type"].startswith("text/csv")
    assert own.content == (folder / "session-00.csv").read_bytes()

    beyond = client.get(f"{address}/session-00/signals", params={"joint": 2})
    assert (beyond.status_code, beyond.json()["detail"]) == (404, "The robot has 1 joints.")

    (folder / "session-01.csv").unlink()
    assert [each["session"] for each in client.get(address).json()] == ["session-00"]
    gone = client.get(f"{address}/session-01")
    assert (gone.status_code, "session-01.csv" in gone.json()["detail"]) == (404, True)
