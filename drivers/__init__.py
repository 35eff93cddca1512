"""The bus, the CiA 402 drive, the SYNC source, the scale, and a simulated rig; and python-can, as all rooms import it."""

import sys

# python-can imports asammdf, and that pandas, wherever they are installed: half a second and 80 MB for each of a session's
# processes, for a log format that is not read here. `None` is Python's way to say that a module is not there.
_present = sys.modules.get("asammdf")
sys.modules["asammdf"] = None  # type: ignore[assignment]
import can  # noqa: E402

if _present is None:
    del sys.modules["asammdf"]
else:
    sys.modules["asammdf"] = _present

__all__ = ["can"]
