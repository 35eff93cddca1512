"""Ends of a command that are no answer: one line on stderr and the status of the contract."""

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
