"""`coulomb stop`: the stop button of a service on this computer, from a terminal."""

from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import typer

TIMEOUT = 3.0
"""s for the answer"""


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("stop")(stop)


def stop(
    rig: Annotated[str | None, typer.Argument(help="The rig; left out, whatever moves.")] = None,
    data: Annotated[
        Path | None, typer.Option(help="Data folder of the service; COULOMB_DATA, else the user's own.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON document on stdout")] = False,
) -> None:
    """Bring what a service on this computer moves to rest, now; no sign-in, by the service's own user.

    Harmless when repeated. `coulomb run` is stopped by Ctrl-C in its own terminal.
    """
    import http.client
    import json
    import socket
    import sys

    from api.data_folder import STOP_SOCKET, default_data_folder

    path = (data or default_data_folder()) / STOP_SOCKET
    address = "/pages/stop" if rig is None else f"/rigs/{quote(rig, safe='')}/stop"
    # No more is imported than this needs: it is a stop.
    connection = http.client.HTTPConnection("localhost", timeout=TIMEOUT)
    try:
        connection.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        connection.sock.settimeout(TIMEOUT)
        connection.sock.connect(str(path))
        connection.request("POST", address)
        answer = connection.getresponse()
        content = json.loads(answer.read())
    except (OSError, http.client.HTTPException) as error:
        print(
            f"coulomb: no service answers at {path} ({getattr(error, 'strerror', None) or error}); if something moves, press "
            "the emergency stop of the machine",
            file=sys.stderr,
        )
        raise typer.Exit(1) from None
    finally:
        connection.close()
    if answer.status != 200:
        print(f"coulomb: {rig}: {content['detail']}", file=sys.stderr)
        raise typer.Exit(1)
    if as_json:
        print(json.dumps(content, ensure_ascii=False))
    elif rig is None:
        print(content["words"])
    else:
        print(f"{rig}: stopping." if content["stopped"] else f"{rig}: nothing was moving.")
