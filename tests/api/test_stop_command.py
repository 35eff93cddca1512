"""`coulomb stop`: by a socket that the service's own user alone can open, without a sign-in."""

import os

import pytest

from api.command_line import application
from api.data_folder import STOP_SOCKET
from api.server import TerminalSocket
from api.service.accounts import Role


def run(*arguments: str) -> int:
    """Exit status of the command."""
    from api.commands import stop

    stop.register(application)
    try:
        result = application(["stop", *arguments], prog_name="coulomb", standalone_mode=False)
    except SystemExit as end:
        return int(end.code or 0)
    except Exception as error:
        return int(getattr(error, "exit_code", 1))
    return int(result or 0)


@pytest.fixture
def short_folder(tmp_path_factory, monkeypatch):
    """A folder whose name is short enough for a socket."""
    return tmp_path_factory.mktemp("s")


def test_a_terminal_stops_without_a_sign_in(listening, data_folder, capsys):
    listening.service.accounts.add_user("ada", "correct horse battery", Role.ADMIN)
    assert (data_folder / STOP_SOCKET).stat().st_mode & 0o777 == 0o600
    assert run("--data", str(data_folder)) == 0
    assert capsys.readouterr().out == "Nothing was moving.\n"
    assert run("bench", "--data", str(data_folder)) == 1
    assert "nothing has moved under this name" in capsys.readouterr().err


def test_where_no_service_answers_the_emergency_stop_is_named(tmp_path, capsys):
    assert run("--data", str(tmp_path)) == 1
    assert "press the emergency stop" in capsys.readouterr().err


def test_the_newest_service_has_the_socket_and_an_older_one_leaves_it(short_folder):
    first = TerminalSocket.open(short_folder)
    second = TerminalSocket.open(short_folder)
    assert first is not None
    assert second is not None
    first.remove()
    assert (short_folder / STOP_SOCKET).exists()
    second.remove()
    assert not (short_folder / STOP_SOCKET).exists()
    for each in (first, second):
        each.socket.close()


def test_a_folder_whose_name_is_too_long_serves_without(tmp_path, capsys):
    folder = tmp_path / ("long" * 40)
    folder.mkdir()
    assert TerminalSocket.open(folder) is None
    assert os.fspath(folder) in capsys.readouterr().err
