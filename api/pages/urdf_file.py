"""The identified model as a URDF, where the experiment came with one to fill in."""

from api.pages.stored_models import ShownModel, StoredExperiment

URDF_FILE = "model.urdf"


def urdf_of(stored: StoredExperiment, shown: ShownModel) -> str | None:
    """The text of the URDF that was written beside the fit, or None where there is none."""
    file = shown.folder / URDF_FILE
    return file.read_text() if file.is_file() else None
