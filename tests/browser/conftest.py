"""A real browser in front of a real service with a simulated rig; screenshots go to artifacts/screenshots/."""

import importlib.util
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import httpx
import pytest
import yaml
from fastapi import FastAPI
from playwright.sync_api import Error as PlaywrightError
from playwright.sync_api import expect, sync_playwright

from api.application import create_application
from api.service.accounts import Role
from api.service.settings import ServiceSettings
from daq.rig import RIGS
from tests.api.served import served

ROOT = Path(__file__).parents[2]
SCREENSHOTS = ROOT / "artifacts" / "screenshots"
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE = 60_000
"""ms in which a page must show what it is asked for. That it does is the statement of these tests, not how quickly: the
machine may be busy with others."""
ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
PASSWORD = "correct horse battery"  # of everybody in these tests
PEOPLE = {"ada": Role.OPERATOR, "grace": Role.OPERATOR, "vera": Role.VIEWER, "root": Role.ADMIN}
RIG = "bench"
HIDDEN = {
    "dry_driving": 18.0,
    "dry_backdriving": 18.0,
    "load_driving": 0.15,
    "load_backdriving": 0.08,
    "load_driving_stribeck": 0.0,
    "load_backdriving_stribeck": 0.0,
}
"""Friction of the simulated joint: 8 to 15 % of the load."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.browser)
            if CHROMIUM is None:
                item.add_marker(pytest.mark.skip(reason="no Chromium here (Debian package chromium)"))


def write_rig(folder: Path, name: str = RIG, **changes: object) -> None:
    """The RX130L's joint 3 with friction that grows with the load, which the usual model does not know.

    faults : as in a rig file
    """
    text = (RIGS / "rx130l-joint3-simulated.yaml").read_text()
    rig = yaml.safe_load(text)
    rig["name"] = name
    rig["description"] = "Joint 3 with something hidden"
    rig["bus"]["channel"] = f"{name}-{os.getpid()}"
    # The service shares this process with the test and the machine with a browser; tests/faults/test_dead_man.py has the
    # time-out that a robot needs.
    rig["supervision"] = {"parent_timeout": 20.0}
    friction = rig["simulated"]["plant"]["axis"]["friction"]
    friction |= HIDDEN
    if "faults" in changes:
        rig["simulated"]["drives"][0]["faults"] = changes["faults"]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(rig))


@dataclass
class Laboratory:
    """A running service: its address, its application and the folder of its data."""

    address: str
    application: FastAPI
    folder: Path


@pytest.fixture
def laboratory_with(tmp_path: Path) -> Iterator[Callable[..., Laboratory]]:
    """Make a service whose rig `bench` hides something; accounts are those of PEOPLE."""
    with _several() as enter:

        def make(**changes: object) -> Laboratory:
            write_rig(tmp_path / "rigs", **changes)
            application = create_application(ServiceSettings(data_folder=tmp_path))
            for name, role in PEOPLE.items():
                application.state.service.accounts.add_user(name, PASSWORD, role)
            return Laboratory(enter(served(application)), application, tmp_path)

        yield make


@contextmanager
def _several() -> Iterator[Callable]:
    with ExitStack() as stack:
        yield stack.enter_context


@pytest.fixture(scope="session")
def chromium() -> Iterator:
    """The browser."""
    expect.set_options(timeout=PATIENCE)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(ARGUMENTS))
        yield browser
        browser.close()


class Visitor:
    """One person in one browser window; any request that leaves the host, and any error of a script, is a failure."""

    def __init__(self, browser, laboratory: Laboratory, **options: object) -> None:
        self.laboratory = laboratory
        self.context = browser.new_context(viewport={"width": 1280, "height": 800}, **options)
        self.context.set_default_timeout(PATIENCE)
        self.page = self.context.new_page()
        self.strangers: list[str] = []
        self.errors: list[str] = []
        self.page.on("request", self._request)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda said: said.type == "error" and self.errors.append(said.text))

    def _request(self, request) -> None:
        if not request.url.startswith(
            (self.laboratory.address, "data:", self.laboratory.address.replace("http", "ws"))
        ):
            self.strangers.append(request.url)

    def sign_in(self, name: str) -> "Visitor":
        self.page.goto(f"{self.laboratory.address}/pages/sign-in")
        self.page.get_by_label("Name").fill(name)
        self.page.get_by_label("Password").fill(PASSWORD)
        self.page.get_by_role("button", name="Sign in").click()
        # A first visit is led to the ways to a first experiment, a later one to the rig.
        expect(self.page).to_have_url(re.compile(r"/pages/(rig|experiments)"))
        self.open("rig")
        return self

    def open(self, name: str) -> None:
        """Go to a page. One that loads itself again at this very moment, because it has news, takes the place of what was
        asked for; then it is asked for again, as a person would."""
        address = f"{self.laboratory.address}/pages/{name}"
        try:
            self.page.goto(address)
        except PlaywrightError as error:
            if not re.search("ERR_ABORTED|interrupted by another navigation", str(error)):
                raise
            self.page.wait_for_load_state()
            self.page.goto(address)

    def step(self, name: str) -> None:
        """Follow one of the six steps in the bar."""
        self.page.get_by_role("navigation", name="Steps").get_by_role("link", name=name).click()

    def shot(self, name: str, narrow: bool = True) -> None:
        """Screenshots of the page as it stands: light, dark, and narrow."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=SCREENSHOTS / f"{name}-light.png", full_page=True)
        self.page.emulate_media(color_scheme="dark")
        self.page.screenshot(path=SCREENSHOTS / f"{name}-dark.png", full_page=True)
        self.page.emulate_media(color_scheme="light")
        if narrow:
            self.page.set_viewport_size({"width": 820, "height": 1180})
            self.page.screenshot(path=SCREENSHOTS / f"{name}-narrow.png", full_page=True)
            self.page.set_viewport_size({"width": 1280, "height": 800})

    def close(self) -> None:
        self.context.close()


@pytest.fixture
def visitor(chromium) -> Iterator[Callable[..., Visitor]]:
    """Open a window for somebody and sign in; at the end nothing may have left the host or failed in a script."""
    opened: list[Visitor] = []

    def make(laboratory: Laboratory, name: str, **options: object) -> Visitor:
        opened.append(Visitor(chromium, laboratory, **options))
        return opened[-1].sign_in(name)

    yield make
    for each in opened:
        each.close()
        assert each.strangers == []
        assert each.errors == []


def of_other_tests(*path: str) -> ModuleType:
    """What the tests in a folder share: its conftest, which pytest gives to those below it only."""
    name = "_".join((*path, "conftest"))
    spec = importlib.util.spec_from_file_location(name, ROOT.joinpath("tests", *path, "conftest.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # where its dataclasses look themselves up
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    """A service with one experiment of three sessions whose fits are stored: nothing is computed, and nothing is changed."""
    folder = tmp_path_factory.mktemp("stored")
    of_other_tests("api", "pages").write_stored_experiment(folder / "experiments" / "rx130l-joint3")
    application = create_application(ServiceSettings(data_folder=folder))
    application.state.service.accounts.add_user("ada", PASSWORD, PEOPLE["ada"])
    with served(application) as address:
        yield Laboratory(address, application, folder)


@pytest.fixture
def measured(laboratory_with, tmp_path):
    """A laboratory with an identified experiment of three sessions, measured elsewhere; and its id."""
    laboratory = laboratory_with()
    tests = of_other_tests("api")
    folder = tests._write_measured_experiment(tmp_path / "measured", sessions=3)
    token = laboratory.application.state.service.accounts.issue_token("ada", "test", "operator", 86400.0)
    headers = {"Authorization": f"Bearer {token.secret}"}
    files = {"file": ("pendulum.zip", tests._zipped(folder))}
    answer = httpx.post(f"{laboratory.address}/experiments/import", files=files, headers=headers, timeout=60)
    assert answer.status_code == 201, answer.text
    return laboratory, answer.json()["experiment"]["id"]
