"""An effect that an installed package offers is first class: in the catalogue, the diagnosis, the page, the plan."""

from __future__ import annotations

import html
import json
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from textwrap import dedent

import pytest

from api.pages import catalogue_words
from api.service import model_workflow
from api.service.accounts import Role
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from identify.effects.catalogue import effects
from identify.recording.errors import InputError
from tests.plants.single_joint import record, write_experiment

RIG = "rx130l-joint3-simulated"
NAME = "end-stop-bumper"
TITLE = "a rubber bumper at the end of the travel"
HOW_TO = (Path(__file__).parents[2] / "docs" / "how-to" / "add-an-effect.md").read_text(encoding="utf-8")
"""The package is the one that the how-to has its reader write."""


def block(language: str) -> str:
    """The code of one language in the how-to."""
    (code,) = re.findall(rf"^```{language}\n(.*?)^```$", HOW_TO, re.MULTILINE | re.DOTALL)
    return code


MODULE, PROJECT = block("python"), block("toml")


def install(source: Path, target: Path, module: str = MODULE) -> Path:
    """Build a wheel of a small package, as its author would, and unpack it where Python looks for packages."""
    source.mkdir()
    (source / "pyproject.toml").write_text(PROJECT)
    (source / "bumper_effect.py").write_text(module)
    build = "from hatchling.build import build_wheel; print(build_wheel('.'))"
    done = subprocess.run(
        [sys.executable, "-c", build], cwd=source, capture_output=True, text=True, check=True, timeout=60
    )
    with zipfile.ZipFile(source / done.stdout.strip().splitlines()[-1]) as wheel:
        wheel.extractall(target)
    return target


def forget_the_catalogue() -> None:
    """What this process has read of the catalogue; a package is usually installed before the program starts."""
    for cached in (
        effects,
        catalogue_words.catalogue,
        catalogue_words.effect_titles,
        catalogue_words._effects_by_parameter,
        model_workflow.effect_names,
    ):
        cached.cache_clear()


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The package, on the path of this process and of the jobs that it starts."""
    target = install(tmp_path / "source", tmp_path / "site-packages")
    monkeypatch.syspath_prepend(str(target))
    monkeypatch.setenv("PYTHONPATH", str(target), prepend=":")
    forget_the_catalogue()
    yield target
    monkeypatch.undo()
    sys.modules.pop("bumper_effect", None)
    forget_the_catalogue()


def coulomb(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "api", *arguments], capture_output=True, text=True, timeout=120, check=False
    )


def test_it_stands_last_in_the_catalogue_with_all_that_it_says(installed):
    *_, last = json.loads(coulomb("effects", "--json").stdout)
    assert last["effect"] == NAME
    assert last["title"] == TITLE
    assert last["needs"] == ["motion over a wide range of positions"]
    assert last["picture"]["label"] == "way into the travel"


def test_the_diagnosis_names_it_and_the_page_shows_it_with_title_and_picture(
    installed, service, finished, zipped, tmp_path
):
    measured = record({"one-sided-bumper": 1.0}, seed=3, duration=20.0, rate=250.0)
    client = service.client(Role.OPERATOR)
    archive = zipped(write_experiment(tmp_path / "measured", measured))
    answer = client.post("/experiments/import", files={"file": ("bumper.zip", archive)}).json()
    assert finished(client, answer["job"])["state"] == "done"
    experiment = answer["experiment"]["id"]
    job = client.post(f"/experiments/{experiment}/models/m1/diagnosis").json()
    assert finished(client, job)["state"] == "done"

    (joint,) = client.get(f"/experiments/{experiment}/models/m1/diagnosis").json()["joints"]
    assert joint["missing"][0] == NAME
    assert joint["candidates"][0]["effect"] == NAME

    page = f"/pages/experiments/{experiment}/missing"
    text = html.unescape(client.get(page, headers={"Accept": "text/html"}).text)
    assert f"The model misses {TITLE}" in text
    evidence = client.get(f"{page}/evidence", params={"effect": NAME}, headers={"Accept": "text/html"}).text
    assert "Residual over way into the travel" in html.unescape(evidence)
    assert 'class="band' in evidence


def test_a_plan_that_leaves_it_no_room_says_so_in_its_report_and_on_the_page(installed, service, tmp_path):
    moves = tuple(Move(to=(0.2 if k % 2 == 0 else 0.0,), duration=1.6, ramp=0.6) for k in range(6))
    plan = ExcitationPlan(name="short way", rig=RIG, joints=("j3",), start=(0.0,), phases=moves)
    file = tmp_path / "plan.json"
    file.write_text(plan.to_json())
    done = coulomb("plan", RIG, "--check", str(file), "--model", "usual", "--json")
    assert done.returncode == 0, done.stderr
    (hidden,) = [each for each in json.loads(done.stdout)["cannot_tell"] if NAME in each["effects"]]
    assert "of the position range" in hidden["reason"]

    service.service.plans.add(plan)
    client = service.client(Role.OPERATOR)
    text = client.get("/pages/new-session", params={"rig": RIG}, headers={"Accept": "text/html"}).text
    (finding,) = [line for line in html.unescape(text).splitlines() if "of the position range" in line]
    assert TITLE.lower() in finding.lower()
    assert hidden["remedy"].lower() in finding.lower()


@pytest.mark.parametrize(
    ("module", "words"),
    [
        ("1 / 0", "cannot be loaded"),
        ("class EndStopBumper: pass", r"is no identify\.effects\.effect\.Effect"),
        (MODULE.replace("    title = ", "    motto = "), "says no 'title'"),
        (MODULE.replace(NAME, "viscous"), "'viscous' is already in the catalogue"),
        (
            MODULE.replace('EffectParameter("bumper", "N m/rad^1.5", lower=0.0)', '("bumper", "N m")'),
            "EffectParameter",
        ),
    ],
)
def test_a_package_that_offers_no_proper_effect_is_named_in_one_line(tmp_path, monkeypatch, module, words):
    target = install(tmp_path / "source", tmp_path / "site-packages", dedent(module))
    monkeypatch.syspath_prepend(str(target))
    forget_the_catalogue()
    try:
        with pytest.raises(InputError, match=words) as refused:
            effects()
        assert f"entry point {NAME}" in str(refused.value)
        assert "\n" not in str(refused.value)
    finally:
        monkeypatch.undo()
        sys.modules.pop("bumper_effect", None)
        forget_the_catalogue()
