"""The drives' own compensation tables from a model."""

from api.client.connection import Connection
from api.service.drive_table_documents import TablesWriting
from api.service.job_documents import JobView
from identify.results.drive_tables import DriveTablesDocument
from identify.results.reading import document_of


class DriveTableCalls(Connection):
    """What a client can ask about the tables of drives."""

    def compute_drive_tables(self, experiment: str, rig: str, model: str | None = None) -> JobView:
        """Choose the tables of a rig's drives from a model version (a job); nothing is written to the drives."""
        return self._begin(f"/experiments/{experiment}/drive-tables", {"rig": rig, "model": model})

    def drive_tables(self, experiment: str, rig: str, model: str | None = None) -> DriveTablesDocument:
        """What the drives are to hold.

        Raises ServiceError with status 404 until they were computed.
        """
        address = f"/experiments/{experiment}/drive-tables"
        return document_of(DriveTablesDocument, self._get(address, rig=rig, model=model), address)

    def write_drive_tables(self, experiment: str, rig: str, model: str | None = None) -> TablesWriting:
        """Write the computed tables to the drives, and read them back; a real drive is changed."""
        address = f"/experiments/{experiment}/drive-tables/writings"
        return self._done(TablesWriting, address, {"rig": rig, "model": model})

    def drive_table_writings(self, experiment: str) -> list[TablesWriting]:
        """Everything that was written, the newest first, with what the drives held before."""
        return self._all(TablesWriting, f"/experiments/{experiment}/drive-tables/writings")

    def write_drive_tables_back(self, experiment: str, writing: str) -> TablesWriting:
        """Write what the drives held before a writing."""
        return self._done(TablesWriting, f"/experiments/{experiment}/drive-tables/writings/{writing}/back")
