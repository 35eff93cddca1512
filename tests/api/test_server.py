"""The socket by which a terminal stops: one service has it, the newest."""

import os

import pytest

from api.data_folder import STOP_SOCKET
from api.server import TerminalSocket


@pytest.fixture
def short_folder(tmp_path_factory, monkeypatch):
    """A folder whose name is short enough for a socket."""
    return tmp_path_factory.mktemp("s")


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
