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
    # what they do together: how their error correlates, and what it is with each payload
    expect(page.get_by_label("Autocorrelation of the error").locator(".choice-line")).to_have_count(1)
    of_payloads = page.get_by_label("Relative error by payload")
    expect(of_payloads.locator(".choice-bar")).to_have_count(3)
    expect(of_payloads.locator(".choice-text").first).to_have_text(re.compile(r"\d.% of the chosen"))
    expect(page.locator("[data-choice-key]").first).to_be_visible()
    expect(page).to_have_url(re.compile(r"chosen=velocity%3A.*load%3A"))
    address = page.url
    page.locator("[data-column-plot]").scroll_into_view_if_needed()
    expect(page.locator("[data-column-plot]")).to_have_attribute("data-drawn", "velocity error")
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme=theme)
        assert violations(page) == []
    page.emulate_media(color_scheme="light")
    ada.shot("model-choice")

    # whoever is sent the address sees the same
    ada.open("rig")
    page.goto(address)
    expect(panel).to_contain_text(re.compile(r"302 of 18.000 samples"))
    page.get_by_role("button", name="Clear the choice").click()
    expect(
        page.locator(".choice-dots, .choice-frame, .choice-bar, .choice-line, .choice-text")
    ).to_have_count(0)
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


def drawn(page) -> list[float]:
    """Ends of both axes of the plot of two columns, as its canvas states them."""
    return [
        float(end) for end in page.locator("[data-column-plot] canvas").get_attribute("data-seen").split()
    ]


def redrawn(page, before: list[float]) -> list[float]:
    """The ends once they are others than before and the samples within them are there."""
    page.wait_for_function(
        """(before) => {
          const canvas = document.querySelector("[data-column-plot] canvas");
          return canvas.dataset.seen !== before && canvas.dataset.fetched === canvas.dataset.seen;
        }""",
        arg=" ".join(map(str, before)),
    )
    return drawn(page)


def test_two_columns_are_zoomed_by_wheel_and_keys_and_moved_by_a_drag(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open(f"{MODEL}?x=velocity&y=error")
    panel = page.locator("[data-column-plot]")
    panel.scroll_into_view_if_needed()
    expect(panel).to_have_attribute("data-drawn", "velocity error")
    canvas = panel.locator("canvas")
    box = canvas.bounding_box()
    whole = drawn(page)
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.45 * box["height"])
    page.mouse.wheel(0, -400)
    near = redrawn(page, whole)
    assert near[1] - near[0] == pytest.approx(0.487 * (whole[1] - whole[0]), rel=0.01)
    assert near[3] - near[2] == pytest.approx(0.487 * (whole[3] - whole[2]), rel=0.01)
    expect(panel.locator("[data-samples]")).to_have_text(re.compile(r"\d of 18.000 samples"))
    # a drag moves what is zoomed and chooses nothing; with the shift key it chooses
    drag(page, box, (0.5, 0.5), (0.6, 0.5))
    moved = redrawn(page, near)
    assert moved[1] - moved[0] == pytest.approx(near[1] - near[0], rel=1e-3)
    assert moved[0] < near[0]
    expect(page.locator("[data-choice]")).to_contain_text("No samples are chosen")
    page.keyboard.down("Shift")
    drag(page, box, (0.4, 0.3), (0.6, 0.7))
    page.keyboard.up("Shift")
    expect(page.locator("[data-choice]")).to_contain_text(re.compile(r"speed .* rad/s and error .* N m"))
    panel.get_by_role("button", name="Choose what is seen").click()
    expect(page).to_have_url(re.compile(f"chosen=velocity%3A{str(moved[0])[:6]}"))
    # the wheel over the labels of an axis zooms along it alone
    page.mouse.move(box["x"] + 10, box["y"] + 0.45 * box["height"])
    page.mouse.wheel(0, -400)
    tall = redrawn(page, moved)
    assert tall[:2] == moved[:2]
    canvas.press("ArrowRight")
    assert redrawn(page, tall)[0] > tall[0]
    ada.shot("model-column-plot")
    canvas.dblclick()
    expect(panel.get_by_role("button", name="All samples")).to_be_hidden()
    page.wait_for_function(
        "(whole) => document.querySelector('[data-column-plot] canvas').dataset.fetched === whole",
        arg=" ".join(map(str, whole)),
    )


def test_two_fingers_zoom_two_columns_and_one_moves_them(stored, visitor) -> None:
    ada = visitor(stored, "ada", has_touch=True)
    page = ada.page
    ada.open(f"{MODEL}?x=velocity&y=error")
    panel = page.locator("[data-column-plot]")
    panel.scroll_into_view_if_needed()
    expect(panel).to_have_attribute("data-drawn", "velocity error")
    box = panel.locator("canvas").bounding_box()
    middle, height = box["x"] + box["width"] / 2, box["y"] + 0.45 * box["height"]
    devtools = page.context.new_cdp_session(page)

    def touch(kind: str, *places: float) -> None:
        fingers = [{"x": place, "y": height, "id": number} for number, place in enumerate(places)]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})

    whole = drawn(page)
    touch("touchStart", middle - 60, middle + 60)
    for apart in (80, 100, 120):
        touch("touchMove", middle - apart, middle + apart)
    touch("touchEnd")
    near = redrawn(page, whole)
    expect(page.locator("[data-choice]")).to_contain_text("No samples are chosen")
    touch("touchStart", middle)
    for moved_by in (0.05, 0.15, 0.25):
        touch("touchMove", middle - moved_by * box["width"])
    touch("touchEnd")
    moved = redrawn(page, near)
    assert moved[0] > near[0]
    assert moved[1] - moved[0] < 0.8 * (whole[1] - whole[0])


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
    # and with another model beside: colour says the model, dots the other session
    page.locator("select[name=beside]").select_option("1")
    expect(page).to_have_url(re.compile("beside=1.*overlay=session-02.csv"))
    expect(page.get_by_text("dotted: models and errors of that session")).to_be_visible()
    page.locator("[data-above] .u-over").hover(position={"x": 300, "y": 100})
    expect(page.locator("[data-torque-plot] [data-cursor]")).to_contain_text(
        re.compile(r"its error −?\d+\.\d+ N m\s*its error, model beside −?\d+\.\d+ N m")
    )
    ada.shot("model-two-sessions-two-models")


def test_what_was_typed_for_a_new_session_survives_other_choices(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open("new-session?rig=rx130l-joint3-simulated&experiment=new")
    page.get_by_label("Name of the new experiment").fill("cold morning")
    page.get_by_label("validation only").check()
    page.locator("select[name=payload]").select_option("new")
    expect(page).to_have_url(re.compile("payload=new"))
    page.get_by_label("Mass, kg").fill("2.5")
    page.locator("select[name=payload]").select_option(index=0)
    expect(page).not_to_have_url(re.compile("payload=new"))
    expect(page.get_by_label("Name of the new experiment")).to_have_value("cold morning")
    expect(page.get_by_label("validation only")).to_be_checked()
