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
    admit: Annotated[
        list[str] | None,
        typer.Option(
            help="file name of an aborted or faulted session that you have looked at; may be repeated"
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON document on stdout")] = False,
) -> None:
    """Close recordings that were left open, keep every sample, and list in the experiment what may serve identification.

    A session that ended because a process died, the power failed or the disk was full is listed by itself once its joints
    have moved for long enough. What a limit, a fault or an operator ended is listed with --admit.
    """
    from daq.recovery import recover_experiment, recover_recording
    from identify.recording.errors import InputError

    reason = "the recording was left open by a kill or a power cut; recovered"
    if experiment.is_file():
        if admit:
            raise InputError(f"--admit: {experiment} is a recording; name the folder of its experiment")
        recordings = [recover_recording(experiment, "faulted", reason)]
    else:
        recordings = recover_experiment(experiment, reason, admit or ())
    for state in recordings:
        listed = "; listed in the experiment" if state.admitted else ""
        lacks = f"; not listed: {state.lacks}" if state.lacks else ""
        line = f"{state.path}: {state.status}, {state.rows} samples: {state.reason}{listed}{lacks}"
        print(line, file=sys.stderr)
    if not recordings:
        print(f"{experiment}: nothing to recover", file=sys.stderr)
    if as_json:
        sessions = [
            {
                "file": str(s.path),
                "status": s.status,
                "reason": s.reason,
                "samples": s.rows,
                "admitted": s.admitted,
                "lacks": s.lacks,
            }
            for s in recordings
        ]
        print(json.dumps({"experiment": str(experiment), "sessions": sessions}, ensure_ascii=False))
