"""Models side by side on the same record: their errors in one table, and the figures of each."""

import os
import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from identify.effects.model import model_name
from identify.identification import Identification, identify
from identify.recording import Experiment, InputError
from identify.results.comparison import ComparisonDocument, ModelErrors


def compare(
    experiment: Experiment, models: Sequence[str], add: Sequence[str] = ()
) -> dict[str, Identification]:
    """Identify with every model. Effects to add go to the last one; to a single model, which then stands beside itself.

    Raises InputError: a model or effect is wrong, or a model is named twice.
    """
    named = [model_name(each) for each in models] or ["usual", *([] if add else ["load-velocity"])]
    if len(set(named)) < len(named):
        raise InputError(f"--model {named[0]}: named twice; compare different models")
    results = {}
    if add and len(named) == 1:
        results[named[0]] = identify(experiment, named[0])
    for name in named:
        added = list(add) if name == named[-1] else []
        results[" + ".join([name, *added])] = identify(experiment, name, added)
    return results


def comparison_document(
    results: dict[str, Identification], figures: Sequence[str] = ()
) -> ComparisonDocument:
    """Errors of every model in all, by joint, session, payload and speed (Tables III and IV).

    figures : files that were drawn of them
    """
    models = []
    for name, result in results.items():
        document = result.document()
        models.append(
            ModelErrors(
                model=name,
                relative_error=document.relative_error,
                relative_error_validation=document.relative_error_validation,
                joints=document.joints,
                sessions=document.sessions,
                payloads=document.payloads,
                speeds=document.speeds,
                form=document.form,
            )
        )
    first = next(iter(results.values()))
    return ComparisonDocument(experiment=first.experiment.name, models=tuple(models), figures=tuple(figures))


def write_figures(results: dict[str, Identification], out: Path) -> list[str]:
    """Write the figures into a folder, all of them or none; returns their names.

    Raises InputError: the folder cannot be written.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out}: is a file; give a folder")
    scratch = out.parent / f".{out.name}-{os.getpid()}"
    try:
        scratch.mkdir(parents=True)
        files = _draw_all(results, scratch)
        out.mkdir(exist_ok=True)
        for file in files:
            (scratch / file).replace(out / file)
    except OSError as error:
        raise InputError(f"--out {out}: cannot be written: {error.strerror or error}") from None
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return files


def _draw_all(results: dict[str, Identification], folder: Path) -> list[str]:
    from identify.validation.figures import draw_course, draw_where, save

    first = next(iter(results.values()))
    record = first.fitted.record
    revolute = [summary.revolute for summary in record.summaries]
    files: list[str] = []
    for name, result in results.items():
        for entry in result.experiment.sessions:
            predictions = [result.predictions[entry.file, joint] for joint in record.joint_names]
            title = f"{name}, {entry.file}, payload {entry.payload.name}"
            figure = draw_course(predictions, title, revolute)
            files += save(figure, folder, f"course-{_file_name(name)}-{_file_name(entry.file)}")
    everywhere = {
        name: [
            [result.predictions[entry.file, joint] for entry in result.experiment.sessions]
            for joint in record.joint_names
        ]
        for name, result in results.items()
    }
    return files + save(draw_where(everywhere, revolute), folder, "where")


def _file_name(text: str) -> str:
    """The text with what file systems dislike replaced; a session without its endings."""
    stem = re.sub(r"(\.csv)?(\.gz)?$|\.h(df)?5$", "", text)
    return re.sub(r"[^A-Za-z0-9._@-]+", "-", stem).strip("-")
