"""Requests made from the OpenAPI document, valid and not: nothing breaks, and nothing undocumented is
answered.
"""

import os

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_schema_conformance,
    status_code_conformance,
    unsupported_method,
)

from api.client import Client
from api.service.accounts import Role

CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_schema_conformance,
    unsupported_method,
]
EXAMPLES = int(os.environ.get("COULOMB_SCHEMATHESIS_EXAMPLES", "6"))
"""Requests for each call and sort; few by default, so that the tests stay quick."""


KNOWN = {
    "experiment": "pendulum",
    "session": "session-00",
    "model": "m1",
    "rig": "rx130l-joint3-simulated",
    "user": "eve",
}
"""Ids that there are, so that valid requests reach more than the lookup."""


@pytest.fixture
def stocked(listening, tmp_path, write_measured_experiment, zipped):
    """A service with an experiment that is identified, and the address and token of its admin."""
    token = listening.client(Role.ADMIN, "z").headers["Authorization"]
    listening.client(Role.VIEWER, "eve")
    archive = tmp_path / "pendulum.zip"
    archive.write_bytes(zipped(write_measured_experiment(tmp_path / "measured")))
    with Client(listening.address, token.removeprefix("Bearer ")) as client:
        client.wait(client.import_experiment(archive).job)
    return listening.address, token


@pytest.mark.parametrize("sort", [GenerationMode.POSITIVE, GenerationMode.NEGATIVE], ids=["valid", "invalid"])
def test_the_service_answers_any_request_as_documented(stocked, sort):
    # A password that was changed at random would lock the caller out: the local operator has none, and may
    # do all but manage people; the calls on people are made by an admin whose own account the requests
    # cannot name.
    address, token = stocked
    document = schemathesis.openapi.from_url(f"{address}/openapi.json", headers={"Authorization": token})
    tried = 0
    for found in document.get_all_operations():
        operation = found.ok()

        @settings(
            max_examples=EXAMPLES,
            derandomize=True,
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(case=operation.as_strategy(generation_mode=sort))
        def check(case):
            if sort is GenerationMode.POSITIVE:
                known = {name: value for name, value in KNOWN.items() if name in (case.path_parameters or {})}
                case.path_parameters = {**(case.path_parameters or {}), **known}
            case.call_and_validate(checks=CHECKS, headers={"Authorization": token})

        check()
        tried += 1
    assert tried > 50
