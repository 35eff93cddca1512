"""A demo's job: three sessions of one plan, each in its share of the time, then the usual model's fit."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from api.service import demo_computation
from api.service.demo_computation import measure_and_fit
from api.simulated_demo import PAYLOADS
from identify.recording.experiment_file import read_experiment_file
from tests.api.short_demo import short_plan


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    file = tmp_path / "plan.json"
    file.write_text(short_plan())
    return file


def test_three_sessions_take_nine_tenths_of_the_time_and_the_fit_the_rest(tmp_path, plan, monkeypatch):
    heard: list[tuple[float, str]] = []
    recorded = []

    def record(rig, folder, plan, payload, operator, progress, *, provisional):
        recorded.append((rig.bus.channel, folder, payload, operator, provisional))
        for driven in (0.0, 0.5, 1.0):
            progress(driven)

    def fit(progress, folder, model, add, output):
        for done in (0.0, 0.5, 1.0):
            progress(done, "fitting")
        return SimpleNamespace(folder=folder, model=model, add=add, output=Path(output))

    monkeypatch.setattr(demo_computation, "record", record)
    monkeypatch.setattr(demo_computation, "fit", fit)
    folder = tmp_path / "arm"
    found = measure_and_fit(
        lambda done, words: heard.append((done, words)), str(folder), "my arm", str(plan), "ada"
    )

    assert [payload for _, _, payload, _, _ in recorded] == list(PAYLOADS) == ["none", "disk-3.5", "disk-7"]
    (channel,) = {channel for channel, *_ in recorded}
    assert channel.startswith("demo-")
    assert {each[1:2] + each[3:] for each in recorded} == {(folder, "ada", True)}
    assert read_experiment_file(folder / "experiment.yaml").name == "my arm"
    assert (found.folder, found.model, found.add) == (str(folder), "usual", [])
    assert found.output == folder / "models" / "m1" / "f1"

    expected = [0.9 * (number + driven) / 3 for number in range(3) for driven in (0.0, 0.0, 0.5, 1.0)]
    assert [done for done, _ in heard] == pytest.approx([*expected, 0.9, 0.95, 1.0])
    assert heard[0][1] == "session 1 of 3, with 0 kg: the drive is checked"
    assert heard[5][1] == "session 2 of 3, with 3.4584 kg: moving"


def test_two_demos_share_no_bus(tmp_path, plan, monkeypatch):
    channels = []
    monkeypatch.setattr(
        demo_computation, "record", lambda rig, *rest, **more: channels.append(rig.bus.channel)
    )
    monkeypatch.setattr(demo_computation, "fit", lambda *what: None)
    for name in ("a", "b"):
        measure_and_fit(lambda done, words: None, str(tmp_path / name), name, str(plan), "ada")
    assert len(set(channels)) == 2
