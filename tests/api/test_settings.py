"""Where a service may listen, and to whom it is open there."""

import pytest

from api.application import create_application
from api.service.accounts import Role
from api.service.settings import ServiceSettings, is_loopback
from identify.recording.errors import InputError

PASSWORD = "correct horse battery"


# --- reaching beyond this machine


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.1", "::", "lab.example"])
def test_without_accounts_the_service_refuses_to_listen_beyond_this_machine(data_folder, host):
    settings = ServiceSettings(data_folder=data_folder, host=host)
    with pytest.raises(InputError, match="coulomb users add NAME --role admin"):
        create_application(settings)


def test_beyond_this_machine_there_is_no_local_operator(start_service, data_folder, clock):
    first = start_service()
    first.service.accounts.add_user("ada", PASSWORD, Role.ADMIN)
    beyond = start_service(host="0.0.0.0")
    assert beyond.client().get("/me").status_code == 401


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        ("localhost", True),
        ("127.0.0.1", True),
        ("127.8.9.1", True),
        ("::1", True),
        ("0.0.0.0", False),
        ("a.b", False),
    ],
)
def test_addresses_of_this_machine_are_told_from_others(host, loopback):
    assert is_loopback(host) is loopback
