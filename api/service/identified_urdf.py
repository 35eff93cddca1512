"""The identified model as a URDF: one choice of standard parameters of real bodies that has the identified base parameters.

It is computed when it is asked for, as a job, and kept beside the fit that it belongs to. It needs the extra `feasible`.
"""

import importlib.util
from pathlib import Path

from api.service.job_process import Progress

URDF_FILE = "model.urdf"


def urdf_of(fit_folder: Path) -> str | None:
    """The text of the URDF that was written beside the fit, or None where there is none."""
    file = fit_folder / URDF_FILE
    return file.read_text() if file.is_file() else None


def can_be_made() -> bool:
    """Whether the extra `feasible` is installed."""
    return all(importlib.util.find_spec(name) is not None for name in ("cvxpy", "clarabel"))


def write_identified_urdf(
    progress: Progress, experiment: str, model: str, add: list[str], output: str
) -> str:
    """Identify, take the nearest feasible standard parameters, and write the URDF; runs in a process of its own.

    output : folder of the fit

    Returns the file's name. Raises InputError where the model has no base parameters of its own.
    """
    import identify
    from identify.dynamics.urdf import write_urdf
    from identify.estimation.feasible import feasible_parameters
    from identify.recording import InputError, load_experiment

    loaded = load_experiment(Path(experiment))
    result = identify.identify(
        loaded, model=model, add=add, progress=lambda done, step: progress(0.6 * done, step)
    )
    progress(0.6, "standard parameters of real bodies")
    standard = [parameter.value for parameter in feasible_parameters(result).standard]
    values = {parameter.name: parameter.value for parameter in result.parameters}
    losses = [[values.get(f"{name}{joint + 1}", 0.0) for joint in range(loaded.n)] for name in ("FV", "FC")]
    try:
        write_urdf(
            Path(output) / URDF_FILE,
            loaded.robot,
            standard,
            name=loaded.name,
            damping=losses[0],
            friction=losses[1],
        )
    except ValueError as error:
        raise InputError(str(error)) from error
    return URDF_FILE
