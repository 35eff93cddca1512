"""Model and measurement by hand: zoom and pan of the torque, marks of sessions, what a cell of the map holds."""

import pytest
from playwright.sync_api import expect

from tests.browser.test_accessibility import violations

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


def shown(page) -> tuple[float, float]:
    """s, the range that the plot states."""
    start, _, stop = page.locator("[data-range]").inner_text().partition(" s")[0].partition(" to ")
    return float(start), float(stop)


def moved(page, before: tuple[float, float]) -> tuple[float, float]:
    """The range once it is another than before."""
    expect(page.locator("[data-range]")).not_to_contain_text(f"{before[0]:.2f} to {before[1]:.2f} s")
    return shown(page)


def settled(page, wanted: tuple[float, float]) -> tuple[float, float]:
    """The range once it is the wanted one within 0.3 s: while a drag goes on, others are stated on its way."""
    page.wait_for_function(
        """([start, stop]) => {
          const said = document.querySelector("[data-range]").textContent.match(/^(\\S+) to (\\S+) s/);
          return Math.abs(said[1] - start) < 0.3 && Math.abs(said[2] - stop) < 0.3;
        }""",
        arg=list(wanted),
    )
    return shown(page)


def test_what_nobody_scrolled_to_is_drawn_when_the_page_is_printed(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    ada.open("experiments/rx130l-joint3/model")
    expect(ada.page.locator("[data-range]")).to_contain_text(" to ")
    panel = ada.page.locator("[data-column-plot]")
    assert panel.get_attribute("data-drawn") is None
    ada.page.pdf()
    assert panel.get_attribute("data-drawn") == "velocity error"
    ada.page.emulate_media(media="print")
    # no panel lies over another one
    tops = ada.page.locator(".with-side .panel").evaluate_all(
        "(panels) => panels.map((panel) => panel.getBoundingClientRect()).map(({ top, bottom }) => [top, bottom])"
    )
    ends = [bottom for _, bottom in tops]
    assert all(top >= end for (top, _), end in zip(tops[1:], ends[:-1], strict=True))


def test_the_torque_is_zoomed_by_the_wheel_and_panned_by_a_drag(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open("experiments/rx130l-joint3/model")
    plot = page.locator("[data-above] .u-over")
    expect(plot).to_be_visible()
    expect(page.locator("[data-range]")).to_contain_text(" to ")
    whole = shown(page)
    box = plot.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.move(*middle)
    page.mouse.wheel(0, -400)
    near = moved(page, whole)
    assert near[1] - near[0] < 0.6 * (whole[1] - whole[0])
    assert sum(near) / 2 == pytest.approx(sum(whole) / 2, abs=0.02 * (whole[1] - whole[0]))
    page.mouse.down()
    page.mouse.move(middle[0] + box["width"] / 4, middle[1], steps=4)
    page.mouse.up()
    way = (near[1] - near[0]) / 4
    panned = settled(page, (near[0] - way, near[1] - way))
    plot.dblclick()
    assert moved(page, panned) == whole
    # a drag over all chooses a stretch
    page.mouse.move(box["x"] + 100, middle[1])
    page.mouse.down()
    page.mouse.move(box["x"] + 200, middle[1], steps=4)
    page.mouse.up()
    chosen = moved(page, whole)
    assert chosen[1] - chosen[0] == pytest.approx(100 / box["width"] * (whole[1] - whole[0]), rel=0.05)

    page.locator("[data-cells]").last.hover(position={"x": 215, "y": 140})
    expect(page.locator("[data-cell-readout]")).to_contain_text("samples)")
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme=theme)
        assert violations(page) == []
    page.evaluate(
        "dispatchEvent(new Event('beforeprint'))"
    )  # on paper in light colours, whatever the screen has
    expect(page.locator("html")).to_have_attribute("data-theme", "light")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    expect(page.locator("html")).not_to_have_attribute("data-theme", "light")
    ada.shot("model-plot")


def test_two_fingers_zoom_about_their_middle_and_one_pans(stored, visitor) -> None:
    ada = visitor(stored, "ada", has_touch=True)
    page = ada.page
    ada.open("experiments/rx130l-joint3/model")
    plot = page.locator("[data-above] .u-over")
    expect(page.locator("[data-range]")).to_contain_text(" to ")
    plot.scroll_into_view_if_needed()
    whole = shown(page)
    box = plot.bounding_box()
    middle, height = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    devtools = page.context.new_cdp_session(page)

    def touch(kind: str, *places: float) -> None:
        fingers = [{"x": place, "y": height, "id": number} for number, place in enumerate(places)]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})

    touch("touchStart", middle - 60, middle + 60)
    for apart in (80, 100, 120):
        touch("touchMove", middle - apart, middle + apart)
    touch("touchEnd")
    quarter = (whole[1] - whole[0]) / 4
    near = settled(page, (whole[0] + quarter, whole[1] - quarter))  # twice as far apart: half the range
    touch("touchStart", middle)
    for moved_by in (0.05, 0.15, 0.25):
        touch("touchMove", middle - moved_by * box["width"])
    touch("touchEnd")
    settled(page, (near[0] + 0.5 * quarter, near[1] + 0.5 * quarter))

    # a finger on a map chooses the cell under it
    figure = page.locator("[data-cells] svg").last
    figure.scroll_into_view_if_needed()
    figure.tap(position={"x": 215, "y": 100})
    expect(page.locator("[data-choice]")).to_contain_text("302 of")
