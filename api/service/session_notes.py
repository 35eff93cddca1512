"""Notes that somebody wrote about sessions: `notes.yaml` beside the experiment, session file -> text; no model depends on it."""

from pathlib import Path

import yaml

from identify.recording.atomic_file import write_atomically
from identify.recording.errors import InputError

NOTES = "notes.yaml"


def read_notes(folder: Path) -> dict[str, str]:
    """Session file -> note. Raises InputError if somebody broke the file."""
    try:
        content = yaml.safe_load((folder / NOTES).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(f"{NOTES}: is not readable as YAML ({error}); correct or remove it") from error
    if content is None:
        return {}
    if not isinstance(content, dict) or not all(
        isinstance(each, str) for pair in content.items() for each in pair
    ):
        raise InputError(f"{NOTES}: must map session files to texts; correct or remove it")
    return content


def write_notes(folder: Path, notes: dict[str, str]) -> None:
    """Write session file -> note in one step."""
    write_atomically(folder / NOTES, yaml.safe_dump(notes, allow_unicode=True).encode())
