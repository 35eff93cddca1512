"""`coulomb export`: a recording as CSV, MAT or Parquet."""

from pathlib import Path
from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("export")(export)


def export(
    recording: Annotated[Path, typer.Argument(help="a recorded session (.h5)")],
    target: Annotated[Path, typer.Argument(help="the file to write: .csv, .csv.gz, .mat or .parquet")],
) -> None:
    """Write a recorded session in SI units: CSV of the contract, MAT for MATLAB, or Parquet."""
    import sys

    from daq.export import export_session

    rows = export_session(recording, target)
    print(f"{rows} rows written to {target}", file=sys.stderr)
