"""`coulomb recover`: finish the sessions that a kill or a power cut left open."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("recover")(recover)


def recover(
    experiment: Annotated[Path, typer.Argument(help="folder of an experiment, or one recording (.h5)")],
    as_json: Annotated[bool, typer.Option("--json", help="one JSON document on stdout")] = False,
) -> None:
    """Close recordings that were left open, keep every sample, and say what each session has and lacks."""
    from daq.recovery import recover_experiment, recover_recording

    reason = "the recording was left open by a kill or a power cut; recovered"
    if experiment.is_file():
        found = [recover_recording(experiment, "faulted", reason)]
    else:
        found = recover_experiment(experiment, reason)
    for state in found:
        print(f"{state.path}: {state.status}, {state.rows} samples: {state.reason}", file=sys.stderr)
    if not found:
        print(f"{experiment}: nothing to recover", file=sys.stderr)
    if as_json:
        sessions = [
            {"file": str(s.path), "status": s.status, "reason": s.reason, "samples": s.rows} for s in found
        ]
        print(json.dumps({"experiment": str(experiment), "sessions": sessions}, ensure_ascii=False))
