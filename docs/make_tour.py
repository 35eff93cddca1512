"""The story of docs/tour.md as screenshots, driven in a browser on a real service with the simulated arm.

    python docs/make_tour.py [--out docs/tour]

From an empty data folder to the effects that were missing, the proof on the drive and the exported model: every picture
shows what the service answered while this ran. Needs Chromium (`CHROMIUM` names it where it is not on the path) and the
packages of the tests.
"""

import argparse
import os
import re
import shutil
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import uvicorn
from playwright.sync_api import Page, expect, sync_playwright

from api.application import create_application
from api.service.settings import ServiceSettings

RIG = "rx130l-joint3-simulated"
SESSIONS = (("none", "0"), ("disk-3.5", "3.4584"), ("disk-7", "6.970"))
"""Payload of the rig's file, and the mass that the scale shows, kg."""
SECONDS = 24
"""Of the plan: the simulated drive moves in real time."""
PATIENCE = 600_000
"""ms for what computes or moves on a busy machine."""
JPEG_QUALITY = 72
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")


@contextmanager
def service(folder: Path) -> Iterator[str]:
    """The address of a service on an empty folder, without accounts: whoever is on this machine is the operator."""
    server = uvicorn.Server(
        uvicorn.Config(
            create_application(ServiceSettings(data_folder=folder)), port=0, log_level="warning", ws="auto"
        )
    )
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.05)
    port = server.servers[0].sockets[0].getsockname()[1]
    try:
        yield f"http://127.0.0.1:{port}"
    finally:
        server.should_exit = True
        thread.join()


class Tour:
    """The pages as an operator goes through them; `picture` keeps what is seen."""

    def __init__(self, page: Page, address: str, out: Path) -> None:
        self.page = page
        self._address = address
        self._out = out
        self._number = 0

    def open(self, name: str) -> None:
        self.page.goto(f"{self._address}/pages/{name}")

    def step(self, name: str) -> None:
        self.page.get_by_role("navigation", name="Steps").get_by_role("link", name=name).click()

    def picture(self, name: str) -> None:
        """Keep the window as it is now."""
        self._number += 1
        file = self._out / f"{self._number:02d}-{name}.jpg"
        self.page.screenshot(path=file, type="jpeg", quality=JPEG_QUALITY)
        print(f"{file}: {file.stat().st_size // 1024} kB")

    def session(self, payload: str, mass: str, first: bool) -> None:
        """One payload session, from the choice of the payload to the robot at rest."""
        page = self.page
        self.open(f"new-session?rig={RIG}" + ("" if first else f"&payload={payload}"))
        if first:
            page.get_by_label("Seconds of a new plan").fill(str(SECONDS))
            page.get_by_role("button", name="Make a plan").click()
            expect(page).to_have_url(re.compile(r"plan="), timeout=PATIENCE)
            page.get_by_label("Name of the new experiment").fill("Joint 3")
            self.picture("plan")
        page.get_by_role("button", name="Prepare the session").click()
        expect(page).to_have_url(re.compile(r"/sessions/session-"), timeout=PATIENCE)
        self.run(mass, picture="check-and-weigh" if first else "")
        if not first and payload == SESSIONS[-1][0]:
            expect(page.locator("[data-run-progress]")).to_have_attribute(
                "value", re.compile(r"0\.[3-9]"), timeout=PATIENCE
            )
            self.picture("live")
        expect(page.locator("[data-live-state]")).to_contain_text("Done", timeout=PATIENCE)

    def run(self, mass: str, picture: str = "") -> None:
        """From a prepared session, or a run of a proof, to the robot in motion."""
        page = self.page
        page.get_by_role("button", name="Check the rig").click()
        expect(page.get_by_label("Mass in kg")).to_be_visible(timeout=PATIENCE)
        page.get_by_label("Mass in kg").fill(mass)
        page.get_by_role("button", name="Enter the mass").click()
        expect(page.get_by_role("button", name="I confirm it")).to_be_visible(timeout=PATIENCE)
        if picture:
            self.picture(picture)
        page.get_by_role("button", name="I confirm it").click()
        page.get_by_role("button", name="Arm", exact=True).click()
        page.get_by_role("button", name="Start: the robot moves").click(timeout=PATIENCE)
        expect(page).to_have_url(re.compile(r"/pages/live"), timeout=PATIENCE)

    def proof(self) -> None:
        """The same plan without and with the model's feedforward torque, and what that does to the following error."""
        page = self.page
        page.get_by_role("link", name="Prove it on the drive").click()
        page.get_by_role("button", name="Prepare the proof").click()
        for which, following in (("first", "Continue the proof"), ("second", "See the comparison")):
            page.get_by_role("button", name=f"Prepare the {which} run").click(timeout=PATIENCE)
            expect(page).to_have_url(re.compile(r"/sessions/proof-"), timeout=PATIENCE)
            self.run("0")
            page.get_by_role("link", name=following).click(timeout=PATIENCE)
        expect(page.locator("[data-following]")).to_be_visible(timeout=PATIENCE)
        self.picture("proof")

    def whole(self) -> None:
        """From the empty folder to the proof and the exported model."""
        page = self.page
        self.open("experiments")
        self.picture("empty-folder")
        self.open(f"rig?rig={RIG}")
        self.picture("rig")
        for place, (payload, mass) in enumerate(SESSIONS):
            self.session(payload, mass, first=place == 0)
        self.step("Model and measurement")
        expect(page.locator("[data-torque-plot] canvas")).to_have_count(2, timeout=PATIENCE)
        expect(page.get_by_role("navigation", name="Session").get_by_role("link")).to_have_count(
            1 + len(SESSIONS), timeout=PATIENCE
        )
        self.picture("model-and-measurement")
        self.step("What is missing")
        expect(page.locator(".candidate .primary").first).to_be_visible(timeout=PATIENCE)
        self.picture("what-is-missing")
        page.locator("#evidence").scroll_into_view_if_needed()
        self.picture("evidence")
        while page.locator(".candidate .primary").count():
            error = page.locator("[data-current-error]").get_attribute("data-current-error") or ""
            page.locator(".candidate .primary").first.click()
            expect(page.locator("[data-current-error]")).not_to_have_attribute(
                "data-current-error", error, timeout=PATIENCE
            )
            expect(page.locator(".verdict .sentence")).not_to_contain_text("Looking", timeout=PATIENCE)
            expect(page.get_by_text("more were tried")).to_be_visible(timeout=PATIENCE)
        page.evaluate("scrollTo(0, 0)")
        self.picture("effects-added")
        self.step("Results")
        self.proof()
        self.step("Results")
        page.get_by_role("button", name="Make Python").click()
        expect(page.get_by_role("link", name="Python")).to_be_visible(timeout=PATIENCE)
        page.get_by_role("link", name="Python").evaluate("(link) => link.scrollIntoView({block: 'center'})")
        self.picture("export")
        report = page.get_by_role("link", name="Report", exact=True).get_attribute("href") or ""
        page.goto(self._address + report)
        page.locator(".added").first.scroll_into_view_if_needed()
        self.picture("report")


def main() -> None:
    """Make the pictures."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", type=Path, default=Path(__file__).with_name("tour"))
    out: Path = arguments.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory() as folder,
        service(Path(folder)) as address,
        sync_playwright() as drive,
    ):
        browser = drive.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(PATIENCE)
        Tour(page, address, out).whole()
        browser.close()


if __name__ == "__main__":
    main()
