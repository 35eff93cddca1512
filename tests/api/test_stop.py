"""`coulomb stop`: by a socket that the service's own user alone can open, without a sign-in."""

from api.command_line import application
from api.data_folder import STOP_SOCKET
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
