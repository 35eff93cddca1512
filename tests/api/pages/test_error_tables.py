"""The sums behind the tables, against the norms of the same samples."""

from dataclasses import replace

import numpy as np
import pytest

from api.pages import error_tables
from api.pages.error_tables import by_payload, by_power_sign, by_session, by_speed, error_sums, files_in_fit
from api.service.stored_samples import COLUMNS, StoredSamples
from tests.api.made_samples import made_samples

FILES = ("a.csv", "b.csv", "c.csv")


@pytest.fixture
def parts() -> dict[str, StoredSamples]:
    """Three sessions; the joint rests now and then, and is fastest where no fit was made of it."""
    rng = np.random.default_rng(8)
    made = {}
    for number, file in enumerate(FILES):
        count = 900 + 37 * number
        measured = 20 * rng.normal(size=count)
        made[file] = made_samples(
            0.01 * np.arange(count),
            velocity=rng.normal(size=count) * (3.0 if file == "c.csv" else 1.0),
            load=rng.normal(size=count),
            measured=measured,
            predicted=measured + rng.normal(size=count),
            moving=(rng.uniform(size=count) < 0.8).astype(float),
        )
    return made


def test_the_tables_are_those_of_the_samples_in_which_the_joint_moves(parts, monkeypatch) -> None:
    monkeypatch.setattr(error_tables, "PIECE", 128)
    fitted = {"a.csv", "b.csv"}
    used = files_in_fit(FILES, fitted)
    sums = error_sums(parts, used)
    joined = {
        name: np.concatenate([getattr(parts[file], name)[parts[file].moving > 0] for file in used])
        for name in COLUMNS
    }
    error = joined["measured"] - joined["predicted"]
    speed, power = np.abs(joined["velocity"]), joined["velocity"] * joined["load"]
    masks = [
        np.ones(len(speed), bool),
        speed <= 0.1 * speed.max(),
        speed >= 0.35 * speed.max(),
        power > 0,
        power < 0,
    ]
    rows = [*by_speed([sums], used), *by_power_sign([sums])]
    for row, mask in zip(rows, masks, strict=True):
        assert row.samples == mask.sum()
        norms = np.linalg.norm(error[mask]) / np.linalg.norm(joined["measured"][mask])
        assert row.errors[0] == pytest.approx(norms)
    payload_of = {"a.csv": "none", "b.csv": "disk", "c.csv": "beam"}
    of_payload = by_payload([sums.sessions], payload_of, used)
    assert [row.words for row in of_payload] == ["none", "disk"]
    of_session = by_session([sums], fitted)
    assert [row.words for row in of_session] == ["a.csv", "b.csv", "c.csv (validation)"]
    assert of_payload[0].errors == of_session[0].errors
    assert sum(row.samples for row in of_session[:2]) == rows[0].samples


def test_sessions_that_no_fit_was_made_of_stand_alone_where_nothing_else_is_shown() -> None:
    assert files_in_fit(["c.csv"], {"a.csv"}) == ["c.csv"]


def test_a_joint_that_never_moved_has_no_error(parts) -> None:
    resting = {file: replace(part, moving=np.zeros_like(part.moving)) for file, part in parts.items()}
    sums = error_sums(resting, FILES)
    assert [row.errors for row in by_speed([sums, sums], FILES)] == [(None, None)] * 3
