"""Results: the parameters, the files, and the report that stands alone."""

import httpx
import pytest

EXPERIMENT = "/pages/experiments/rx130l-joint3"


@pytest.mark.parametrize("page", ["results", "report"])
def test_the_bodies_of_the_robots_file_stand_beside_what_was_identified(
    browser_client: httpx.Client, models: dict, page: str
) -> None:
    text = browser_client.get(f"{EXPERIMENT}/{page}").text
    part = text[text.index("Compared with the bodies in arm.urdf") :]
    part = part[: part.index("</ul>")]
    assert part.index("ZZ1R") < part.index("28.50") < part.index(">rotor<") < part.index("MX1")
    assert 'class="number loose">7.4<' in part  # 20 / 2.7 deviations apart
    assert "identified differently: MX1" in part


def test_the_report_stands_alone(browser_client: httpx.Client) -> None:
    response = browser_client.get(f"{EXPERIMENT}/report")
    text = response.text
    assert response.status_code == 200
    for loaded in ("<script", "<link", "<img", "url(", "@font-face", "@import"):
        assert loaded not in text
    # measured against predicted for three sessions, maps of the first model and of this one, a staircase, four bands,
    # and views of the effect that was added
    views = text.count("<h3>load-friction-asymmetric: ")
    assert views >= 1
    assert text.count("<svg") == 3 + 2 + 1 + 4 + views
    assert "sha256-" in response.headers["content-security-policy"]


def test_the_report_kept_as_a_file_has_a_name(browser_client: httpx.Client) -> None:
    response = browser_client.get(f"{EXPERIMENT}/report", params={"keep": "true"})
    assert 'filename="rx130l-joint3-model-2.html"' in response.headers["content-disposition"]


def test_the_report_says_where_the_sessions_are_from_and_what_each_added_effect_did(
    browser_client: httpx.Client, models: dict
) -> None:
    text = browser_client.get(f"{EXPERIMENT}/report").text
    sessions = text[text.index("<h2>Sessions") : text.index("<h2>Errors")]
    for session in models["with load"].document().sessions:
        assert f'<th scope="row">{session.file}</th>' in sessions
    added = text[text.index("<h3>Added: load-friction") :]
    for words in ("error on motion that the fit did not see", "without it", "with it"):
        assert words in added[: added.index("</section>")]


def test_on_paper_no_heading_is_parted_from_its_figure_and_legends_keep_their_colours(
    browser_client: httpx.Client,
) -> None:
    text = browser_client.get(f"{EXPERIMENT}/report").text
    assert "print-color-adjust: exact" in text
    assert ".report .keep { break-inside: avoid; }" in text
    figures = [place for place in range(len(text)) if text.startswith("<figure", place)]
    assert len(figures) >= 10
    for place in figures:  # each stands in a piece that is kept on one page, with a heading before it
        piece = text[text.rindex('class="keep', 0, place) : place]
        assert "</section>" not in piece
        assert "<h3" in piece
