"""`coulomb scan`: the nodes on a CAN bus."""

from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("scan")(scan)


def scan(
    interface: Annotated[str, typer.Option(help="python-can's name: socketcan, slcan, virtual, pcan, …")],
    channel: Annotated[str, typer.Option(help="can0, /dev/ttyACM0, …")],
    bitrate: Annotated[int, typer.Option(help="bit/s; socketcan takes it from `ip link`")] = 1_000_000,
    wait: Annotated[float, typer.Option(help="s to wait for answers")] = 0.3,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON document")] = False,
) -> None:
    """List the nodes on a bus with their identity (0x1018), profile (0x1000) and state. Only reads."""
    import dataclasses
    import json

    from drivers.bus import BusSettings
    from drivers.errors import BusError
    from drivers.scan import scan as scan_bus
    from identify.recording.errors import InputError

    if wait <= 0:
        raise InputError(f"--wait: must be above 0 s, not {wait:g}")
    if bitrate <= 0:
        raise InputError(f"--bitrate: must be above 0 bit/s, not {bitrate}")
    try:
        answering = scan_bus(BusSettings(interface=interface, channel=channel, bitrate=bitrate), wait=wait)
    except BusError as error:
        raise InputError(f"--interface {interface} --channel {channel}: {error}") from error
    if as_json:
        nodes = [dataclasses.asdict(node) | {"profile": node.profile} for node in answering]
        print(json.dumps({"interface": interface, "channel": channel, "nodes": nodes}, indent=1))
        return
    if not answering:
        print(f"no node answered on {interface} channel {channel}")
        return

    from rich.console import Console
    from rich.table import Table

    table = Table("node", "profile", "vendor", "product", "revision", "serial", "NMT state", "drive state")
    for node in answering:
        numbers = (node.vendor, node.product, node.revision, node.serial)
        table.add_row(
            str(node.node),
            "–" if node.profile is None else str(node.profile),
            *("–" if number is None else f"0x{number:X}" for number in numbers),
            node.nmt_state or "no heartbeat",
            node.state or "–",
        )
    Console().print(table)
