"""Who may not call is not listened to: bodies, forms in many parts, proxies that nobody named, and the OpenAPI document."""

import asyncio
import socket
from urllib.parse import urlsplit

import httpx
import pytest

from api.application import create_application
from api.pages.results_page import _cell
from api.server import ServiceServer, listen
from api.service.accounts import Role
from api.service.guard import Guard
from api.service.settings import ServiceSettings
from api.service.upload_slots import MOST_OF_A_USER
from identify.recording.errors import InputError

UPLOAD = "/experiments/import"


MEBIBYTE = 1024 * 1024


def listened_to(application, path, headers, size, kind="multipart/form-data; boundary=x"):
    """The status of a POST whose body comes in blocks of 64 kB, and how many bytes the application behind the guard asked for."""
    asked = 0

    async def receive():
        nonlocal asked
        asked += 65536
        return {"type": "http.request", "body": bytes(65536), "more_body": asked < size}

    status = []

    async def send(message):
        if message["type"] == "http.response.start":
            status.append(message["status"])

    heard = 0

    async def inner(scope, receive, send):
        nonlocal heard
        before = asked
        await application_behind(scope, receive, send)
        heard = asked - before

    guard = application.middleware_stack
    while not isinstance(guard, Guard):
        guard = guard.app
    application_behind, guard.app = guard.app, inner
    try:
        names = {"host": "localhost:8000", "content-type": kind, **headers}
        scope = {
            "type": "http",
            "method": "POST",
            "path": path,
            "raw_path": path.encode(),
            "query_string": b"",
            "root_path": "",
            "scheme": "http",
            "http_version": "1.1",
            "headers": [(name.lower().encode(), value.encode()) for name, value in names.items()],
            "client": ("127.0.0.1", 1),
            "server": ("localhost", 8000),
        }
        asyncio.run(application(scope, receive, send))
    finally:
        guard.app = application_behind
    return status[0], heard


@pytest.mark.parametrize(
    "path", [UPLOAD, "/pages/experiments/import", "/experiments/x/sessions/import", "/plans"]
)
@pytest.mark.parametrize("role", [None, Role.VIEWER], ids=str)
def test_the_body_of_who_may_not_send_it_is_never_taken_in(service, path, role):
    service.client(Role.ADMIN)
    token = {} if role is None else {"Authorization": service.client(role).headers["Authorization"]}
    status, heard = listened_to(service.application, path, token, 8 * MEBIBYTE)
    assert (status, heard) == (401 if role is None else 403, 0)


def test_strangers_send_no_more_than_a_name_and_a_password(service):
    service.client(Role.ADMIN)
    for path in ("/sign-in", "/pages/sign-in", "/nowhere"):
        status, heard = listened_to(service.application, path, {}, MEBIBYTE)
        assert heard <= 2 * 65536
        assert status in (400, 404, 405, 413, 415)


def test_a_route_that_takes_no_file_takes_no_large_form(service):
    token = {"Authorization": service.client(Role.ADMIN).headers["Authorization"]}
    status, heard = listened_to(service.application, "/pages/users", token, 32 * MEBIBYTE)
    assert status in (400, 413)
    assert heard <= 2 * MEBIBYTE


def test_an_upload_holds_one_file_and_a_form_of_a_page(service):
    operator = service.client(Role.OPERATOR)
    for files, fields in (
        ([("file", ("a.zip", b"x"))] * 2, {}),
        ([("file", ("a.zip", b"x"))], {f"field{number}": "x" for number in range(100)}),
        ([("file", ("a.zip", b"x"))], {"payload": "x" * 100_000}),
    ):
        answer = operator.post(UPLOAD, files=files, data=fields)
        assert answer.status_code == 400, answer.text
    many = [("files", ("a.csv", b"t,q\n0,0\n"))] * 13
    answer = operator.post("/experiments/import/columns", files=many, data={"dialect": "{}"})
    assert answer.status_code == 400, answer.text


def test_strangers_fill_no_log(service):
    admin = service.client(Role.ADMIN)
    stranger = service.client()
    for _ in range(20):
        stranger.post("/plans", json={})
        stranger.post("/nowhere")
    assert admin.get("/audit").json() == []
    stranger.post("/sign-in", json={"name": "eve", "password": "guessed password"})
    assert [row["outcome"] for row in admin.get("/audit").json()] == ["401"]


def test_no_more_uploads_are_taken_in_at_the_same_time_than_may(listening, tmp_path):
    """Real connections that stand half way: the third of one user is refused, and one that ends makes room."""
    token = listening.client(Role.OPERATOR).headers["Authorization"]
    place = urlsplit(listening.address)

    def half_way():
        connection = socket.create_connection((place.hostname, place.port))
        connection.sendall(
            f"POST {UPLOAD} HTTP/1.1\r\nHost: {place.netloc}\r\nAuthorization: {token}\r\n"
            "Content-Type: multipart/form-data; boundary=x\r\nContent-Length: 1000\r\n\r\n--x\r\n".encode()
        )
        return connection

    def another():
        return httpx.post(
            f"{listening.address}{UPLOAD}", headers={"Authorization": token}, files={"file": ("a.zip", b"x")}
        ).status_code

    standing = [half_way() for _ in range(MOST_OF_A_USER)]
    while (status := another()) != 429:
        assert status == 422
    standing[0].close()
    while (status := another()) != 422:
        assert status == 429
    standing[1].close()


@pytest.mark.parametrize(
    ("trusted", "address"), [((), "127.0.0.1"), (("127.0.0.1",), "192.0.2.7"), (("192.0.2.1",), "127.0.0.1")]
)
def test_what_a_proxy_says_is_believed_only_of_those_that_were_named(data_folder, trusted, address):
    settings = ServiceSettings(data_folder=data_folder)
    create_application(settings).state.service.accounts.add_user("root", "correct horse battery", Role.ADMIN)
    application = create_application(settings.model_copy(update={"trusted_proxies": trusted}))
    listening = listen("127.0.0.1", 0)
    config = ServiceServer(application, listening).config
    config.load()
    listening.close()
    seen = []

    async def answering(scope, _receive, _send):
        seen.append(scope["client"][0])

    application.middleware_stack = answering
    scope = {
        "type": "http",
        "client": ("127.0.0.1", 5),
        "scheme": "http",
        "headers": [(b"x-forwarded-for", b"192.0.2.7")],
        "path": "/",
        "method": "GET",
    }
    asyncio.run(config.loaded_app(scope, None, None))
    assert seen == [address]


@pytest.mark.parametrize("header", ["X-Forwarded-For", "Forwarded", "X-Real-IP", "Via"])
def test_who_comes_through_a_proxy_is_not_the_operator_at_the_machine(service, header):
    assert service.client().get("/me").status_code == 200
    assert service.client().get("/me", headers={header: "192.0.2.7"}).status_code == 401


def test_a_proxy_is_named_only_once_there_is_an_account(data_folder):
    with pytest.raises(InputError, match="nobody has an account"):
        create_application(ServiceSettings(data_folder=data_folder, trusted_proxies=("127.0.0.1",)))


def test_browsers_are_told_to_stay_with_https_where_there_is_https(start_service, service):
    assert "Strict-Transport-Security" not in service.client().get("/me").headers
    over_tls = start_service(secure_cookies=True).client().get("/me")
    assert over_tls.headers["Strict-Transport-Security"] == "max-age=31536000"


def test_the_openapi_document_is_for_who_is_signed_in_once_there_are_accounts(service):
    assert service.client().get("/openapi.json").json()["info"]["title"] == "coulomb"
    viewer = service.client(Role.VIEWER)
    assert service.client().get("/openapi.json").status_code == 401
    assert "/plans" in viewer.get("/openapi.json").json()["paths"]


def test_no_answer_names_a_folder_of_this_computer(service, data_folder, write_measured_experiment):
    operator = service.client(Role.OPERATOR)
    folder = write_measured_experiment(data_folder / "experiments" / "broken")
    service.service.experiments.reindex()
    (folder / "session-00.csv").write_text("t,q1\n")
    (data_folder / "rigs").mkdir(exist_ok=True)
    (data_folder / "rigs" / "odd.yaml").write_text("name: [")
    (data_folder / "plans").mkdir(exist_ok=True)
    (data_folder / "plans" / "odd.json").write_text("{")
    answers = [
        operator.get("/experiments/broken/recordings/session-00/signals"),
        operator.get("/rigs"),
        operator.get("/rigs/odd"),
        operator.get("/plans/odd"),
        operator.get("/experiments/broken"),
    ]
    assert [str(data_folder) in answer.text for answer in answers] == [False] * len(answers)
    assert answers[0].status_code == 422
    assert "session-00.csv" in answers[0].json()["detail"]


def test_a_job_that_fails_names_no_folder_of_this_computer(
    service, data_folder, write_measured_experiment, finished
):
    operator = service.client(Role.OPERATOR)
    folder = write_measured_experiment(data_folder / "experiments" / "broken")
    service.service.experiments.reindex()
    (folder / "session-00.csv").write_text("t,q1\n")
    job = finished(operator, operator.post("/experiments/broken/models", json={"model": "usual"}).json())
    assert job["state"] == "failed"
    assert "session-00.csv" in job["words"]
    assert str(data_folder) not in job["words"]


@pytest.mark.parametrize("name", ["arm\x1b[2J", "arm\u202e", "arm\x7f", "arm\n"])
def test_names_with_characters_that_are_not_shown_are_refused(service, name):
    operator = service.client(Role.OPERATOR)
    rig = "rx130l-joint3-simulated"
    answers = [
        operator.post("/experiments", json={"name": name, "rig": rig}),
        operator.post("/plans", json={"name": name, "rig": rig}),
        operator.post("/tokens", json={"label": name}),
        operator.post("/users", json={"name": name, "password": "correct horse battery"}),
    ]
    assert [answer.status_code for answer in answers] == [422, 422, 403, 403]
    with pytest.raises(InputError, match="not shown"):
        service.service.rigs.experiment_file(rig, name)


def test_a_download_of_parameters_holds_no_formula():
    assert _cell("=HYPERLINK(1)") == "'=HYPERLINK(1)"
    assert (_cell(-1.5), _cell(None), _cell("ZZ1R")) == (-1.5, "", "ZZ1R")
