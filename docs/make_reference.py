"""The reference of all public modules, classes and functions as HTML, made of their docstrings by pdoc.

    python docs/make_reference.py FOLDER

Open FOLDER/index.html; nothing is fetched from anywhere. Fails where a module cannot be imported.
"""

import os
import pkgutil
import sys
import warnings
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("identify", "daq", "drivers", "api")


def main(folder: Path) -> None:
    sys.path.insert(0, str(ROOT))
    os.environ["PDOC_ALLOW_EXEC"] = "1"  # the platform module asks `uname`
    import pdoc
    from pdoc import extract

    import identify

    # These names are imported when they are first used, which pdoc does not see.
    for name in identify.__all__:
        setattr(identify, name, getattr(identify, name))
    warnings.simplefilter("error", UserWarning)
    pdoc.render.configure(
        template_directory=ROOT / "docs" / "reference_theme", footer_text="made by `make docs`", search=True
    )
    # A package with `__all__` shows pdoc no more than that: modules that it leaves out are named one by one.
    names = list(ROOMS)
    shown = set(extract.walk_specs(names))
    for room in ROOMS:
        for module in pkgutil.walk_packages([str(ROOT / room)], f"{room}."):
            if module.name not in shown and "._" not in module.name:
                names.append(module.name)
                shown.update(extract.walk_specs([module.name]))
    pdoc.pdoc(*names, output_directory=folder)


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
