"""Results: the identified parameters, and the files to take along."""

import csv
import io

import httpx
import pytest
import yaml

from api.pages.results_page import URDF_NAME, _cell
from api.service.accounts import Role

EXPERIMENT = "/pages/experiments/rx130l-joint3"


def test_every_parameter_stands_with_both_deviations_and_its_grouping(
    browser_client: httpx.Client, models: dict
) -> None:
    text = browser_client.get(f"{EXPERIMENT}/results").text
    for parameter in models["with load"].document().parameters:
        assert f"<b>{parameter.name}</b>" in text
    assert "ZZ1 + Ia1" in text


def test_the_downloads_hold_the_document_of_the_fit(browser_client: httpx.Client, models: dict) -> None:
    expected = models["usual"].document()
    as_json = browser_client.get(f"{EXPERIMENT}/download/json", params={"version": "m1"})
    as_yaml = browser_client.get(f"{EXPERIMENT}/download/yaml", params={"version": "m1"})
    as_csv = browser_client.get(f"{EXPERIMENT}/download/csv", params={"version": "m1"})
    assert as_json.json() == expected.to_json()
    assert yaml.safe_load(as_yaml.text) == expected.to_json()
    rows = list(csv.DictReader(io.StringIO(as_csv.text)))
    assert [row["name"] for row in rows] == [parameter.name for parameter in expected.parameters]
    assert [float(row["value"]) for row in rows] == [parameter.value for parameter in expected.parameters]
    assert "rx130l-joint3-model-1.csv" in as_csv.headers["content-disposition"]


def test_an_unknown_download_is_answered_with_what_there_is(browser_client: httpx.Client) -> None:
    response = browser_client.get(f"{EXPERIMENT}/download/xls")
    assert response.status_code == 404
    assert "json, csv and yaml" in response.text


def test_cells_are_texts_that_no_table_program_computes_and_none_is_empty() -> None:
    assert [_cell(each) for each in (None, 0.0, 1.5, "FV", "=1+1")] == ["", 0.0, 1.5, "FV", "'=1+1"]


def test_the_current_version_is_downloaded_unless_another_is_asked_for(browser_client: httpx.Client) -> None:
    for asked, number in (({}, 2), ({"version": "m1"}, 1), ({"version": "m3"}, 3)):
        answer = browser_client.get(f"{EXPERIMENT}/download/csv", params=asked)
        assert f'filename="rx130l-joint3-model-{number}.csv"' in answer.headers["content-disposition"]
        assert answer.headers["content-type"].startswith("text/csv")


@pytest.mark.parametrize("possible", [True, False])
def test_a_urdf_is_offered_where_there_is_one_and_can_be_asked_for_where_it_can_be_made(
    browser_client: httpx.Client, monkeypatch: pytest.MonkeyPatch, possible: bool
) -> None:
    monkeypatch.setattr("api.pages.results_page.can_be_made", lambda: possible)
    answer = browser_client.get(f"{EXPERIMENT}/download/urdf")
    assert answer.status_code == 404
    assert "There is no URDF of this model yet" in answer.text
    text = browser_client.get(f"{EXPERIMENT}/results").text
    assert "/download/urdf?" not in text
    assert (f"{EXPERIMENT}/urdf?version=m2" in text) == possible


def test_the_page_offers_the_files_of_the_version_that_it_shows(browser_client: httpx.Client) -> None:
    for asked, shown in (({}, "m2"), ({"version": "m1"}, "m1")):
        text = browser_client.get(f"{EXPERIMENT}/results", params=asked).text
        for ending in ("json", "csv", "yaml"):
            assert f'"{EXPERIMENT}/download/{ending}?version={shown}"' in text
        assert f'"{EXPERIMENT}/report?version={shown}"' in text


@pytest.mark.parametrize("page", ["results", "download/csv"])
def test_before_the_first_fit_it_is_said_what_to_do(service, write_measured_experiment, page) -> None:
    write_measured_experiment(service.service.experiments.root / "pendulum", seconds=1.0)
    service.service.experiments.reindex()
    viewer = service.client(Role.VIEWER)
    answer = viewer.get(f"/pages/experiments/pendulum/{page}", headers={"Accept": "text/html"})
    assert answer.status_code == (200 if page == "results" else 404)
    assert ("Not identified yet" if page == "results" else "measure or import a session first") in answer.text
    assert URDF_NAME not in answer.text
