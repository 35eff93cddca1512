"""Table IV: a model identified with the sessions without payload alone, kept beside the fit with all of them."""

from __future__ import annotations

import pytest

import identify
from api.service.without_payload import errors_without_payload, identify_without_payload
from identify.recording.errors import InputError
from tests.plants.single_joint import record, write_experiment


def made(folder, masses):
    recorded = record({}, seed=3, duration=8.0, rate=200.0, repeats=1, payload_masses=masses)
    return write_experiment(folder, recorded)


def test_only_sessions_without_payload_are_in_the_fit_and_its_errors_are_kept(tmp_path):
    folder, output = made(tmp_path / "joint", (0.0, 2.0)), tmp_path / "m1"
    output.mkdir()
    assert errors_without_payload(output) is None
    heard = []
    found = identify_without_payload(
        lambda done, step: heard.append(done), str(folder), "usual", [], str(output)
    )
    loaded = identify.load_experiment(folder)
    (empty,) = [payload.name for payload in loaded.payloads if payload.mass == 0]
    alone = identify.identify(loaded, "usual", payloads=[empty]).document()
    assert found.samples == alone.samples
    assert found.joints == pytest.approx({each.joint: each.relative_error for each in alone.joints})
    assert errors_without_payload(output) == found
    assert heard == sorted(heard)
    assert 0 <= heard[0] <= heard[-1] <= 1


def test_where_every_session_carries_something_it_is_said_what_is_needed(tmp_path):
    folder = made(tmp_path / "joint", (2.0, 4.0))
    with pytest.raises(InputError, match="no session without payload was measured; measure one to compare"):
        identify_without_payload(lambda done, step: None, str(folder), "usual", [], str(tmp_path))
    assert errors_without_payload(tmp_path) is None
