"""`coulomb serve`: the REST service and the web page."""

from pathlib import Path
from typing import Annotated

import typer

from api.command_arguments import Cluster, Workers


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command()(serve)


def serve(
    host: Annotated[
        str, typer.Option(help="Address to listen on; anything but this machine's own needs accounts.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on; 0 takes a free one.")
    ] = 8000,
    data: Annotated[
        Path | None,
        typer.Option(
            help="Folder of experiments, rigs, plans and database; COULOMB_DATA, else the user's own."
        ),
    ] = None,
    database: Annotated[
        str | None, typer.Option(help="SQLAlchemy address of another database (sqlite, postgresql).")
    ] = None,
    allow_host: Annotated[
        list[str] | None, typer.Option(help="A name under which browsers reach this service; repeatable.")
    ] = None,
    scale: Annotated[str | None, typer.Option(help="Serial port of the weighing scale.")] = None,
    jobs: Annotated[int, typer.Option(min=1, max=64, help="Computations at the same time.")] = 1,
    workers: Workers = 1,
    cluster: Cluster = None,
    stop_port: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            help="Port for stops alone, which answers whatever the service is doing; by https the port after --port.",
        ),
    ] = None,
    tls_certificate: Annotated[
        Path | None, typer.Option(help="Certificate (PEM), to answer by https.", exists=True, dir_okay=False)
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(help="Key of the certificate (PEM).", exists=True, dir_okay=False)
    ] = None,
    behind_tls: Annotated[
        bool, typer.Option(help="A proxy in front answers by https: cookies are then sent by https only.")
    ] = False,
    trusted_proxy: Annotated[
        list[str] | None,
        typer.Option(
            help="Address or network of a proxy in front, which is believed from where requests come; repeatable."
        ),
    ] = None,
    disk_budget: Annotated[
        float | None,
        typer.Option(
            min=0.1, max=1e6, help="GB that the data folder may take; the disk's own room if not said."
        ),
    ] = None,
    job_memory: Annotated[
        float | None,
        typer.Option(
            min=0.1, max=1e6, help="GB that one job may take; half of the memory, at most 8, if not said."
        ),
    ] = None,
    job_hours: Annotated[
        float, typer.Option(min=0.01, max=1000.0, help="Hours that one job may take.")
    ] = 2.0,
) -> None:
    """Serve experiments, rigs and models over REST and as pages, until interrupted."""
    from api.computing import Computing
    from api.data_folder import default_data_folder
    from api.server import run_service
    from api.service.process_limits import GIBIBYTE, half_of_memory
    from api.service.settings import MOST_JOB_MEMORY, ServiceSettings, network_of
    from identify.recording.errors import InputError

    for proxy in trusted_proxy or ():
        network_of(proxy)
    if (tls_certificate is None) != (tls_key is None):
        raise InputError("--tls-certificate and --tls-key go together: give both, or neither")
    Computing(workers, cluster).check()
    run_service(
        ServiceSettings(
            data_folder=data or default_data_folder(),
            database_url=database,
            host=host,
            port=port,
            allowed_hosts=tuple(name.lower() for name in allow_host or ()),
            secure_cookies=behind_tls or tls_certificate is not None,
            scale_port=scale,
            simultaneous_jobs=jobs,
            workers=workers,
            cluster=cluster,
            disk_budget=None if disk_budget is None else int(disk_budget * 1e9),
            trusted_proxies=tuple(trusted_proxy or ()),
            job_seconds=job_hours * 3600.0,
            job_memory=half_of_memory(MOST_JOB_MEMORY) if job_memory is None else int(job_memory * GIBIBYTE),
        ),
        certificate=tls_certificate,
        key=tls_key,
        stop_port=stop_port,
    )
