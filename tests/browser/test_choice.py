"""One choice of samples in all pictures, by mouse and by touch; two columns over each other; two sessions over each other."""

import re

import pytest
from playwright.sync_api import expect

from tests.browser.test_accessibility import violations

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

MODEL = "experiments/rx130l-joint3/model"


def drag(page, box: dict, start: tuple[float, float], stop: tuple[float, float]) -> None:
    """From one place of a box to another, as parts of it."""
    page.mouse.move(box["x"] + start[0] * box["width"], box["y"] + start[1] * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + stop[0] * box["width"], box["y"] + stop[1] * box["height"], steps=3)
    page.mouse.up()


def test_what_is_chosen_in_one_picture_is_shown_in_all_others(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open(MODEL)
    panel, plot = page.locator("[data-choice]"), page.locator("[data-torque-plot]")
    expect(panel).to_contain_text("No samples are chosen")
    page.locator("[data-cells] svg").last.click(position={"x": 215, "y": 100})
    expect(panel).to_contain_text(re.compile(r"speed .* rad/s and load .* N m"))
    expect(panel).to_contain_text(re.compile(r"302 of 18.000 samples. Error of model 2: 6.69 N m RMS"))
    # both maps and the bands have a frame or dots, the histogram bars; and it stands in the address
    expect(page.locator(".choice-dots")).to_have_count(6)
    expect(page.locator(".choice-bar").first).to_be_visible()
    expect(page).to_have_url(re.compile(r"chosen=velocity%3A.*load%3A"))
    address = page.url
    page.locator("[data-column-plot]").scroll_into_view_if_needed()
    expect(page.locator("[data-column-plot]")).to_have_attribute("data-drawn", "velocity error")
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme=theme)
        assert violations(page) == []
    ada.shot("model-choice")

    # whoever is sent the address sees the same
    ada.open("rig")
    page.goto(address)
    expect(panel).to_contain_text(re.compile(r"302 of 18.000 samples"))
    page.get_by_role("button", name="Clear the choice").click()
    expect(page.locator(".choice-dots, .choice-frame, .choice-bar")).to_have_count(0)
    expect(page).not_to_have_url(re.compile("chosen"))

    page.get_by_role("button", name="session-01.csv").click()
    expect(panel).to_contain_text(re.compile(r"6000 of 18.000 samples"))
    page.get_by_role("navigation", name="Session").get_by_role("link", name="1 · none").click()
    expect(panel).to_contain_text("No sample of what is shown here")
    # a stretch of time: what the torque plot shows of one session
    expect(page.locator("[data-range]")).to_contain_text("0.00 to")
    page.keyboard.press("+")
    expect(page.locator("[data-range]")).to_contain_text("this window")
    page.get_by_role("button", name="Choose this stretch").click()
    expect(panel).to_contain_text(
        re.compile(r"time in the session 1[45].\d to 4[45].\d s, in session-00.csv")
    )
    expect(plot).to_be_visible()


def test_any_two_columns_stand_over_each_other_and_a_rectangle_chooses(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open(f"{MODEL}?x=position&y=measured")
    panel = page.locator("[data-column-plot]")
    panel.scroll_into_view_if_needed()
    expect(panel).to_have_attribute("data-drawn", "position measured")
    box = panel.locator("canvas").bounding_box()
    drag(page, box, (0.3, 0.2), (0.6, 0.7))
    expect(page.locator("[data-choice]")).to_contain_text(
        re.compile(r"position .* rad and measured torque .* N m")
    )
    expect(page).to_have_url(re.compile(r"x=position&y=measured&chosen=position"))
    page.get_by_role("button", name="Columns of the record").click()
    expect(panel.locator("[data-cursor]")).to_contain_text("1 columns of the record")
    panel.locator("[data-y]").select_option("command")
    expect(panel).to_have_attribute("data-drawn", "position command")
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])


def test_two_sessions_lie_over_each_other(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open(f"{MODEL}?session=session-00.csv")
    page.locator("[data-overlay]").select_option("session-02.csv")
    expect(page.get_by_text("other session, measured")).to_be_visible()
    expect(page).to_have_url(re.compile("overlay=session-02.csv"))
    expect(page.locator("[data-torque-plot] canvas")).to_have_count(2)
    page.locator("[data-above] .u-over").hover(position={"x": 300, "y": 100})
    expect(page.locator("[data-torque-plot] [data-cursor]")).to_contain_text(
        re.compile(r"other session, measured −?\d+\.\d+ N m")
    )
    ada.shot("model-two-sessions")


def test_what_was_typed_for_a_new_session_survives_other_choices(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open("new-session?rig=rx130l-joint3-simulated&experiment=new")
    page.get_by_label("Name of the new experiment").fill("cold morning")
    page.get_by_label("check the model on it only").check()
    page.locator("select[name=payload]").select_option("new")
    expect(page).to_have_url(re.compile("payload=new"))
    page.get_by_label("Mass, kg").fill("2.5")
    page.locator("select[name=payload]").select_option(index=0)
    expect(page).not_to_have_url(re.compile("payload=new"))
    expect(page.get_by_label("Name of the new experiment")).to_have_value("cold morning")
    expect(page.get_by_label("check the model on it only")).to_be_checked()
