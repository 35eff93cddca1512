"""`coulomb fake-drive`: the simulated drives of a rig as a process of its own, for any CANopen master."""

from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("fake-drive")(fake_drive)


def fake_drive(
    rig: Annotated[str, typer.Argument(help="a rig file, or the name of a rig; it must be simulated")],
    interface: Annotated[
        str | None, typer.Option(help="python-can's name, e.g. socketcan; the rig's where left out")
    ] = None,
    channel: Annotated[str | None, typer.Option(help="e.g. vcan0; the rig's where left out")] = None,
    payload: Annotated[
        str | None, typer.Option(help="payload on the arm; the rig's first where left out")
    ] = None,
    seed: Annotated[int, typer.Option(help="changes the noise; same seed, same numbers")] = 0,
    seconds: Annotated[float | None, typer.Option(help="end after so many seconds instead of Ctrl-C")] = None,
) -> None:
    """Put the simulated drives of a rig on a bus and keep them there until Ctrl-C."""
    import signal
    import sys
    import threading

    from daq.rig import Rig
    from daq.simulated_rig import simulated_rig
    from drivers.errors import BusError
    from identify.recording.errors import InputError

    loaded = Rig.load(rig)
    changed = {"interface": interface, "channel": channel}
    bus = loaded.bus.model_copy(update={name: value for name, value in changed.items() if value is not None})
    if bus.interface == "virtual":
        raise InputError(
            "--interface: a virtual bus ends with this process, nobody could reach the drives; "
            "name a real one, such as socketcan"
        )
    if seconds is not None and seconds <= 0:
        raise InputError(f"--seconds: must be above 0, not {seconds:g}")
    mounted = loaded.payload(payload) if payload is not None else loaded.payloads[0]
    ended = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: ended.set())
    try:
        with simulated_rig(loaded, mounted, bus, seed) as drives:
            nodes = ", ".join(str(node.node) for node in drives.nodes)
            where = f"on {bus} with payload {mounted.name}"
            print(f"fake-drive: nodes {nodes} {where}; Ctrl-C ends them", flush=True)
            ended.wait(seconds)
    except BusError as error:
        raise InputError(f"--interface {bus.interface} --channel {bus.channel}: {error}") from error
    print("fake-drive: gone", file=sys.stderr)
