"""`coulomb export`: a model into a program's own form, with a certificate; or a recording as CSV, MAT or Parquet."""

from pathlib import Path
from typing import Annotated

import typer

from api.command_arguments import Additions, AsJson, ModelName


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("export")(export)


def export(
    source: Annotated[
        str,
        typer.Argument(
            help="an experiment (folder, experiment.yaml, stored name), or a recorded session (.h5)"
        ),
    ],
    target: Annotated[
        Path,
        typer.Argument(
            help="of an experiment's model: .urdf, .sdf, .xml (MJCF), .py, .c, .st, .fmu or .json; of a recording: .csv, .csv.gz,"
            " .mat or .parquet"
        ),
    ],
    model: ModelName = "usual",
    add: Additions = None,
    as_json: AsJson = False,
) -> None:
    """Write an identified model for a simulator or a controller, and what that keeps and costs beside it; or a recorded
    session in SI units.
    """
    import sys

    if source.lower().endswith((".h5", ".hdf5")):
        import json

        from daq.export import export_session

        rows = export_session(Path(source), target)
        print(f"{rows} rows written to {target}", file=sys.stderr)
        if as_json:
            print(json.dumps({"target": str(target), "rows": rows}, ensure_ascii=False))
        return
    from api.certificate_text import certificate_text
    from api.stored_experiments import resolve
    from identify.export.write import checked_target, require_no_other_s_file
    from identify.export.write import export as export_model
    from identify.recording import load_experiment

    checked_target(target)
    require_no_other_s_file(target)
    certificate = export_model(load_experiment(resolve(source)), target, model, add or [])
    print(certificate.json_text() if as_json else certificate_text(certificate))
