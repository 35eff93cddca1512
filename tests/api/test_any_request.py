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


@pytest.mark.parametrize("sort", [GenerationMode.POSITIVE, GenerationMode.NEGATIVE], ids=["valid", "invalid"])
def test_the_service_answers_any_request_as_documented(listening, sort):
    # A password that was changed at random would lock the caller out: the local operator has none, and may
    # do all but manage people; the calls on people are made by an admin whose own account the requests
    # cannot name.
    token = listening.client(Role.ADMIN, "z").headers["Authorization"]
    document = schemathesis.openapi.from_url(
        f"{listening.address}/openapi.json", headers={"Authorization": token}
    )
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
            case.call_and_validate(checks=CHECKS, headers={"Authorization": token})

        check()
        tried += 1
    assert tried > 50
