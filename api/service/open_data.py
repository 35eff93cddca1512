"""The data folder of a service, opened by a command beside or without the running service."""

import getpass
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from api.data_folder import default_data_folder
from api.service.accounts import Accounts, Role, User
from api.service.audit import AuditLog
from api.service.database import Database, open_database
from api.service.experiment_store import ExperimentStore
from identify.results.document import Json


@dataclass(frozen=True)
class OpenedData:
    """What a command works on."""

    database: Database
    accounts: Accounts
    experiments: ExperimentStore
    audit: AuditLog

    def note(self, action: str, target: str, details: Json) -> None:
        """Write what a command changed into the audit log, under the system's user name."""
        user = User(f"{getpass.getuser()} (command line)"[:64], Role.ADMIN, "local")
        self.audit.append(user, action, target, "done", details=details)


@contextmanager
def open_data(folder: Path | None, database_url: str | None) -> Iterator[OpenedData]:
    """Open the data folder (None: the default one) and its database.

    Raises InputError if they cannot be used.
    """
    folder = folder or default_data_folder()
    database = open_database(folder, database_url)
    try:
        yield OpenedData(
            database,
            Accounts(database, time.time),
            ExperimentStore(database, folder / "experiments", time.time),
            AuditLog(database, time.time),
        )
    finally:
        database.close()
