"""What jobs compute of a model that is to be used: how it predicts motion, and the files that other programs take."""

from pathlib import Path

import identify
from api.service.job_process import Progress
from identify.recording import load_experiment
from identify.results.certificate import Certificate
from identify.results.simulation import SimulationDocument


def simulate(progress: Progress, experiment: str, model: str, add: list[str]) -> SimulationDocument:
    """A model run forward in windows along its record, beside the usual one."""
    from identify.simulation.simulate import HORIZONS, simulated

    loaded = load_experiment(Path(experiment))
    result = identify.identify(
        loaded, model=model, add=add, progress=lambda done, words: progress(0.2 * done, words)
    )
    usual = None if model == "usual" and not add else identify.identify(loaded, model="usual")
    return simulated(
        result,
        usual,
        HORIZONS,
        free_run=False,
        progress=lambda done, words: progress(0.3 + 0.6 * done, words),
    )


def export(progress: Progress, experiment: str, model: str, add: list[str], target: str) -> Certificate:
    """A model written for another program, with its certificate beside it.

    target : the file; its folder is made here
    """
    from identify.export.write import write_export

    loaded = load_experiment(Path(experiment))
    result = identify.identify(
        loaded, model=model, add=add, progress=lambda done, words: progress(0.5 * done, words)
    )
    progress(0.5, "writing, and loading back what was written")
    Path(target).parent.mkdir(exist_ok=True)
    return write_export(result, Path(target))
