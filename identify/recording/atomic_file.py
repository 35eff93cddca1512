"""Writing a file so that a reader, or a crash, never sees half of it."""

import os
import secrets
from pathlib import Path


def write_atomically(file: Path, content: bytes) -> None:
    """Replace `file` by `content`; afterwards it is on disk, not just in the cache."""
    temporary = file.with_name(f".{file.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(file)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    descriptor = os.open(file.parent, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
