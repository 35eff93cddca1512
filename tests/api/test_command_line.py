"""Ends of a command that are no answer: one line on stderr and the status of the contract."""

import io
import os
import sys
import tomllib
from pathlib import Path

import pytest
import typer

import api.command_line


@pytest.mark.parametrize("ended", [KeyboardInterrupt, typer.Abort])
def test_a_command_that_was_interrupted_says_so_and_ends_with_status_1(monkeypatch, capsys, ended):
    application = typer.Typer()

    @application.command()
    def interrupted() -> None:
        raise ended

    monkeypatch.setattr(api.command_line, "application", application)
    monkeypatch.setattr(api.command_line, "_register_commands", lambda asked: None)
    monkeypatch.setattr("sys.argv", ["coulomb"])
    with pytest.raises(SystemExit) as end:
        api.command_line._run()
    assert end.value.code == 1
    assert capsys.readouterr().err == "coulomb: interrupted\n"


def test_a_name_that_is_no_text_is_refused_in_one_line(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["coulomb", "identify", os.fsdecode(b"Pr\xfcfstand")])
    with pytest.raises(SystemExit) as end:
        api.command_line._run()
    assert end.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith("coulomb: 'Pr\\udcfcfstand': not UTF-8; rename the file")
    assert said.count("\n") == 1


def test_a_terminal_without_a_character_of_the_answer_gets_the_rest_of_it(monkeypatch):
    written = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(written, encoding="ascii"))
    monkeypatch.setattr("sys.argv", ["coulomb", "effects"])
    with pytest.raises(SystemExit) as end:
        api.command_line._run()
    sys.stdout.flush()
    assert not end.value.code
    assert b"viscous" in written.getvalue()


def test_the_version_is_told_as_by_other_tools(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["coulomb", "--version"])
    with pytest.raises(SystemExit) as end:
        api.command_line._run()
    assert end.value.code == 0
    declared = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    assert capsys.readouterr().out == f"coulomb {declared['project']['version']}\n"
