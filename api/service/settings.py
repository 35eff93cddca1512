"""What the service is started with."""

import ipaddress
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from api.computing import Computing
from api.data_folder import default_data_folder
from api.service.process_limits import GIBIBYTE, MEBIBYTE, ProcessLimits, half_of_memory
from daq.rig import RIGS
from identify.recording.errors import InputError

LONGEST_JOB = 2 * 3600.0
"""s that a job may take; the longest diagnosis measured, of six joints, takes some minutes."""
MOST_JOB_MEMORY = 8 * GIBIBYTE
"""Bytes that a job may have on a computer of twice as much or more."""


class ServiceSettings(BaseModel):
    """Settings of one running service; every duration in seconds, every size in bytes."""

    model_config = ConfigDict(frozen=True)

    data_folder: Path = Field(default_factory=default_data_folder)
    """Holds `experiments/`, `rigs/`, `plans/` and `service.sqlite`."""
    database_url: str | None = None
    """SQLAlchemy address of another database; None is SQLite in the data folder."""
    host: str = "127.0.0.1"
    port: int = 8000
    allowed_hosts: tuple[str, ...] = ()
    """Further names under which browsers reach this service (Host header), without port."""
    secure_cookies: bool = False
    """True where browsers come by https: the sign-in cookie then never travels in clear."""
    trusted_proxies: tuple[str, ...] = ()
    """Addresses or networks of proxies that are believed from where a request comes; nobody else is."""
    sign_in_lasts: float = 12 * 3600.0
    body_limit: int = 1 * MEBIBYTE
    """Largest request body but for uploads."""
    upload_limit: int = 256 * MEBIBYTE
    """Largest uploaded file."""
    disk_budget: int | None = None
    """Bytes that the data folder may take; None for as many as the disk has beside a reserve."""
    unpacked_limit: int = 2048 * MEBIBYTE
    """Largest sum of what an uploaded archive unpacks to."""
    upload_seconds: float = 60.0
    """What reading one upload, or one recording that somebody looks at, may take, s."""
    upload_memory: int = Field(default_factory=lambda: half_of_memory(4 * GIBIBYTE))
    """And how much memory."""
    job_seconds: float = LONGEST_JOB
    """What one job may take, s."""
    job_memory: int = Field(default_factory=lambda: half_of_memory(MOST_JOB_MEMORY))
    """And how much memory."""
    simultaneous_jobs: int = 1
    """Jobs that compute at the same time, each in a process of its own."""
    workers: int = 1
    """Processes that a job divides the sessions of its experiment among."""
    cluster: str | None = None
    """Address of a Dask scheduler whose workers jobs use instead; None where they compute on this machine."""
    live_rate: float = 20.0
    """Blocks of live samples per second that viewers are sent, Hz."""
    scale_port: str | None = None
    """Serial port of the weighing scale; None where masses are typed."""
    clock: Callable[[], float] = time.time
    """Seconds since 1970; tests hand in their own."""

    @property
    def computing(self) -> Computing:
        """Where jobs reduce sessions."""
        return Computing(self.workers, self.cluster)

    @property
    def upload_limits(self) -> ProcessLimits:
        """What the process may take that reads an upload or a recording."""
        return ProcessLimits(
            self.upload_memory, self.upload_seconds, descriptors=256, written=self.unpacked_limit
        )

    @property
    def job_limits(self) -> ProcessLimits:
        """What the process of a job may take."""
        return ProcessLimits(self.job_memory, self.job_seconds)

    def without_folders(self, text: str) -> str:
        """The same words without the folders of this computer, which are nobody else's business."""
        for folder in (self.data_folder, self.data_folder.resolve(), RIGS, Path(tempfile.gettempdir())):
            text = text.replace(f"{folder}/", "").replace(str(folder), folder.name)
        return text

    @property
    def experiments_folder(self) -> Path:
        """Folder whose sub-folders are the stored experiments."""
        return self.data_folder / "experiments"

    @property
    def bound_to_loopback(self) -> bool:
        """True if only programs on this machine reach the service."""
        return is_loopback(self.host)


def is_loopback(host: str) -> bool:
    """True for `localhost` and every address that stands for this machine alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def network_of(proxy: str) -> ipaddress.IPv4Network | ipaddress.IPv6Network:
    """The network that `--trusted-proxy` names. Raises InputError where it is none."""
    try:
        return ipaddress.ip_network(proxy)
    except ValueError as error:
        raise InputError(f"--trusted-proxy {proxy}: not an address or a network ({error})") from error
