"""One story of models, two processes that fit them: a `coulomb run` beside the service."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from api.service.model_story import ModelStory
from api.service.refit import folder_apart, next_refit

ROOT = Path(__file__).parents[2]
STORED = ROOT / "tests" / "identify" / "results" / "stored-format-1"

FITS = """
import sys
from pathlib import Path
from api.service.computations import FitFound
from api.service.model_story import ModelStory
from api.service.refit import folder_apart, fresh_folder, next_refit, store_refit
from identify.results.identification import IdentificationDocument
from identify.results.reading import read_document

experiment, document, name, count = sys.argv[1:]
identification = read_document(IdentificationDocument, Path(document))
story = ModelStory(Path(experiment))

def computed(folder, number):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "made-by").write_text(f"{name} {number}")
    return FitFound(identification, f"{name} {number}", folder)

print("ready", flush=True)
sys.stdin.readline()
for number in range(int(count)):
    refit = next_refit(story)
    if name == "service":
        store_refit(story, computed(fresh_folder(story, refit.version, refit.fit), number), name)
    else:
        with folder_apart(story, refit.version) as folder:
            store_refit(story, computed(folder, number), name)
"""


def fitting(experiment: Path, name: str, count: int) -> subprocess.Popen[str]:
    document = STORED / "m1" / "f1" / "identification.json"
    process = subprocess.Popen(
        [sys.executable, "-c", FITS, str(experiment), str(document), name, str(count)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


@pytest.mark.parametrize("others", [("run", "run"), ("service", "run")])
@pytest.mark.parametrize("begun", [False, True], ids=["first fits", "further fits"])
def test_two_processes_lose_no_fit_and_mix_none_up(tmp_path, others, begun):
    if begun:
        shutil.copytree(STORED, tmp_path / "models")
    before = {
        (version.id, fit.id) for version in ModelStory(tmp_path).read().versions for fit in version.fits
    }
    names = [f"{name}" if place == 0 else f"{name}-2" for place, name in enumerate(others)]
    processes = [fitting(tmp_path, name, 30) for name in names]
    for process in processes:
        process.stdin.write("go\n")
        process.stdin.flush()
    for process in processes:
        process.communicate(timeout=60)
        assert process.returncode == 0
    story = ModelStory(tmp_path)
    made = {
        fit.data: (version.id, fit.id)
        for version in story.read().versions
        for fit in version.fits
        if (version.id, fit.id) not in before
    }
    assert made.keys() == {f"{name} {number}" for name in names for number in range(30)}
    assert len(set(made.values())) == 60
    for data, (version, fit) in made.items():
        assert (story.folder / version / fit / "made-by").read_text() == data
    assert not list(story.folder.glob("apart-*"))


def test_a_computation_beside_the_service_that_stores_nothing_leaves_nothing(tmp_path):
    story = ModelStory(tmp_path)
    with folder_apart(story, "m1") as folder:
        folder.mkdir(parents=True)
    assert list(story.folder.iterdir()) == []
    assert next_refit(story).version == "m1"
