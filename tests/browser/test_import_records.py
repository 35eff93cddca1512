"""A log of a control cabinet in its own dialect is dropped on the page; its columns are seen, and the first fit follows."""

import re

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

PATIENCE = 120_000  # ms for what computes
SCREENS = {"desk": (1280, 800), "phone": (390, 844)}


def export_of_a_control_cabinet() -> bytes:
    """One joint that swings under gravity with friction: preamble, semicolons, decimal commas, cp1252."""
    time = np.arange(0, 8, 0.005)
    position = np.sin(2 * time) + 0.3 * np.sin(5 * time)
    velocity = 2 * np.cos(2 * time) + 1.5 * np.cos(5 * time)
    acceleration = -4 * np.sin(2 * time) - 7.5 * np.sin(5 * time)
    torque = 0.8 * acceleration + 9.0 * np.cos(position) + 1.2 * velocity + 2.0 * np.sign(velocity)
    rows = zip(1000 * time, np.degrees(position), 1000 * torque / 10, strict=True)
    cells = "".join(";".join(f"{value:.4f}".replace(".", ",") for value in row) + "\r\n" for row in rows)
    return f"Prüfstand 3\r\n\r\nZeit [ms];Istlage [Grad];Motorstrom [mA]\r\n{cells}".encode("cp1252")


def check_appearance(visitor, name: str) -> None:
    """Axe finds nothing and nothing is wider than its screen, light or dark; screenshots are kept."""
    page = visitor.page
    for screen, (width, height) in SCREENS.items():
        page.set_viewport_size({"width": width, "height": height})
        wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert page.evaluate(wide) <= 0, f"{name} is wider than the {screen}"
        visitor.shot(f"{name}-{screen}", narrow=False)
    page.set_viewport_size({"width": 1280, "height": 800})
    for theme in ("dark", "light"):
        page.emulate_media(color_scheme=theme)
        assert [each["id"] for each in Axe().run(page).response["violations"]] == []


def test_a_foreign_csv_becomes_a_first_fit(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    ada = visitor(laboratory, "ada")
    page = ada.page
    ada.open("experiments")
    page.get_by_role("link", name="Import records").click()
    record = {"name": "messung.csv", "mimeType": "text/csv", "buffer": export_of_a_control_cabinet()}
    page.get_by_label("Drop files here").set_input_files(record)
    expect(page.locator("[data-record] svg")).to_have_count(3)
    expect(page.locator("[data-record]")).to_contain_text("−72.648 to 72.648 deg")
    expect(page.locator("select[name=position]")).to_have_value("Istlage [Grad]")
    expect(page.locator("select[name=command]")).to_have_value("Motorstrom [mA]")
    expect(page.locator("select[name=time]")).to_have_value("Zeit [ms]")
    check_appearance(ada, "records")

    page.locator("input[name=gravity]").fill("0 -9,81 0")
    page.get_by_role("button", name="Import and fit").click()
    expect(page.locator("#problem")).to_contain_text("Gain of joint 1 is missing")
    ada.errors.clear()  # the browser itself says that a request was refused
    page.locator("input[name=gain]").fill("10")
    page.get_by_role("button", name="Import and fit").click()
    expect(page).to_have_url(re.compile("/pages/experiments/messung/model$"))
    expect(page.get_by_text("Condition number")).to_be_visible(timeout=PATIENCE)

    ada.open("records")
    form = page.locator("form", has=page.get_by_role("button", name="Import the logs and fit"))
    log = {"name": "bus.log", "mimeType": "text/plain", "buffer": b"(0.000000) can0 183#0000000000003712\n"}
    form.locator("input[name=files]").set_input_files(log)
    form.locator("select[name=rig]").select_option("rx130l-joint3-simulated")
    page.get_by_role("button", name="Import the logs and fit").click()
    expect(page.locator("#problem")).to_contain_text("bus.log: holds no SYNC")
    ada.errors.clear()

    page.get_by_label("Drop files here").set_input_files(record)
    expect(page.locator("select[name=position]")).to_have_value("Istlage [Grad]")
    records = page.locator("#records")
    records.locator("select[name=experiment]").select_option("messung")
    records.locator("select[name=role]").select_option("validation")
    records.locator("select[name=keep]").select_option("Motorstrom [mA]")
    page.get_by_role("button", name="Import and fit").click()
    expect(page.locator("#problem")).to_contain_text("each column has one role")
    ada.errors.clear()
    records.locator("select[name=keep]").select_option([])
    page.get_by_role("button", name="Import and fit").click()
    expect(page).to_have_url(re.compile("/pages/experiments/messung/model$"))
    ada.open("experiments/messung/sessions")
    expect(page.get_by_text("session-01").first).to_be_visible()
