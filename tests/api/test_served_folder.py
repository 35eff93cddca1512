"""A data folder has one service; a lock that is left, or cannot be had, keeps nobody out."""

import errno
import fcntl
import os
import subprocess
import sys

import pytest

from api.served_folder import SERVED, served_alone
from identify.recording.errors import InputError


def take(folder):
    with served_alone(folder):
        pass


def test_who_comes_second_is_told_who_is_there_until_the_first_has_ended(tmp_path):
    with served_alone(tmp_path) as say_where:
        with pytest.raises(
            InputError, match=rf"{tmp_path}: another service \(process {os.getpid()}, starting\)"
        ):
            take(tmp_path)
        say_where("http://127.0.0.1:8000/")
        with pytest.raises(
            InputError, match=r"process \d+, http://127.0.0.1:8000/\) serves it; end that one"
        ):
            take(tmp_path)
    take(tmp_path)
    assert (tmp_path / SERVED).read_text() == f"process {os.getpid()}, starting"


KILLED = """
import os, pathlib, sys
from api.served_folder import served_alone
with served_alone(pathlib.Path(sys.argv[1])):
    os._exit(9)
"""


def test_a_service_that_was_killed_leaves_the_folder_free(tmp_path):
    assert subprocess.run([sys.executable, "-c", KILLED, tmp_path], check=False).returncode == 9
    assert (tmp_path / SERVED).exists()
    take(tmp_path)


def test_programs_that_the_service_starts_do_not_hold_its_folder(tmp_path):
    with served_alone(tmp_path):
        child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    take(tmp_path)
    child.communicate(b"\n")


def test_a_file_system_without_locks_turns_nobody_away(tmp_path, monkeypatch):
    def refuse(*_arguments):
        raise OSError(errno.ENOLCK, "no locks here")

    monkeypatch.setattr(fcntl, "flock", refuse)
    with served_alone(tmp_path) as say_where:
        say_where("http://127.0.0.1:8000/")
    assert (tmp_path / SERVED).read_text() == ""


def test_a_folder_that_cannot_be_made_is_left_to_who_needs_it(tmp_path):
    (tmp_path / "file").touch()
    with served_alone(tmp_path / "file" / "data") as say_where:
        say_where("http://127.0.0.1:8000/")


def test_a_link_in_place_of_the_lock_is_not_followed(tmp_path):
    (tmp_path / "other").write_text("mine")
    (tmp_path / SERVED).symlink_to(tmp_path / "other")
    with served_alone(tmp_path) as say_where:
        say_where("http://127.0.0.1:8000/")
    assert (tmp_path / "other").read_text() == "mine"
