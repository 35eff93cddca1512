"""Every refusal is a problem document (RFC 9457) that says what would be right."""

import pytest

from api.service.accounts import Role


def problem(answer, status):
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document = answer.json()
    assert document["status"] == status
    assert document["type"] == "about:blank"
    assert document["title"]
    assert document["instance"].startswith("/")
    return document["detail"]


@pytest.fixture
def operator(service):
    return service.client(Role.OPERATOR)


def test_an_unknown_address(operator):
    assert problem(operator.get("/nowhere"), 404) == "Nothing is at this address."


def test_an_unknown_id(operator):
    assert problem(operator.get("/experiments/none"), 404) == "No experiment has the id `none`."


def test_a_method_that_is_not_possible_names_those_that_are(operator):
    answer = operator.delete("/experiments")
    assert problem(answer, 405) == "DELETE is not possible here."
    assert "GET" in answer.headers["Allow"]


def test_a_body_that_is_no_json(operator):
    headers = {"Content-Type": "application/json"}
    assert (
        problem(operator.post("/experiments", content="{", headers=headers), 400) == "The body is not JSON."
    )


def test_a_body_of_another_kind(operator):
    answer = operator.post("/experiments", content="name: x", headers={"Content-Type": "application/yaml"})
    assert problem(answer, 415) == "Send the body as application/json."


def test_a_field_that_is_wrong_is_named(operator):
    answer = operator.post("/experiments", json={"name": "", "rig": "x"})
    assert "body.name" in problem(answer, 422)
    assert answer.json()["errors"][0]["where"] == "body.name"


def test_a_wrong_item_of_a_list_is_named_alone_and_not_the_list_that_lacks_it(operator):
    gains = {"joints": [{"joint": "j1", "position": True, "velocity": 1.0}]}
    answer = operator.post("/experiments/none/models/m1/simulation", json=gains)
    assert problem(answer, 422) == "body.joints.0.position: Input should be a valid number"


def test_a_text_of_another_form_is_answered_in_words(operator):
    answer = operator.get("/experiments/arm/models/latest")
    assert (
        problem(answer, 422)
        == "path.model: must be a model's version: `m` and its number from 1, such as `m2`"
    )


def test_nobody_signed_in(service):
    service.client(Role.ADMIN)
    assert "Sign in" in problem(service.client().get("/experiments"), 401)


def test_a_role_that_does_not_suffice(operator):
    assert problem(operator.get("/users"), 403) == "This needs the role admin; the-operator asks as operator."


@pytest.mark.parametrize("announced", [True, False])
def test_a_body_larger_than_accepted_is_refused_whether_or_not_its_length_was_announced(
    start_service, announced
):
    service = start_service(body_limit=1000, upload_limit=5000)
    operator = service.client(Role.OPERATOR)
    body = b'{"name": "' + b"x" * 2000 + b'", "rig": "r"}'
    content = body if announced else iter([body])
    answer = operator.post("/experiments", content=content, headers={"Content-Type": "application/json"})
    assert problem(answer, 413) == "The body is larger than 1000 bytes."
    upload = operator.post("/experiments/import", files={"file": ("a.zip", b"x" * 6000)})
    assert problem(upload, 413) == "The body is larger than 5000 bytes."


def test_an_experiment_file_that_somebody_broke_is_named_with_its_field(operator, service):
    operator.post("/experiments", json={"name": "arm", "rig": "rx130l-joint3-simulated"})
    file = service.service.experiments.folder("arm") / "experiment.yaml"
    file.write_text(file.read_text().replace("type: revolute", "type: revolting"))
    found = operator.get("/experiments/arm").json()
    assert "type" in found["problem"]
    assert "revolting" in found["problem"]


def test_an_error_of_our_own_is_a_problem_document_too_and_tells_no_secrets(operator, service, monkeypatch):
    def broken():
        raise ValueError("secret")

    monkeypatch.setattr(service.service.experiments, "rows", broken)
    answer = operator.get("/experiments")
    assert "secret" not in problem(answer, 500)
