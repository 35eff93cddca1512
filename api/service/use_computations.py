"""What jobs compute of a model that is to be used: how it predicts motion, the files that other programs take, and the torque
that is sent as feedforward along a plan."""

from dataclasses import dataclass
from pathlib import Path

import identify
from api.proof import Part, TorqueAhead
from api.service.free_run_curves import stored_runs
from api.service.job_process import Progress
from daq.excitation.excitation_plan import ExcitationPlan
from daq.rig import Rig
from identify.identification import Identification
from identify.recording import Payload, load_experiment
from identify.recording.controller_file import ControllerFile
from identify.results.certificate import Certificate
from identify.results.drive_tables import DriveTablesDocument
from identify.results.simulation import SimulationDocument


@dataclass(frozen=True)
class PredictedMotion:
    """How a model predicts motion.

    runs : the free runs, as `free_run_curves` keeps them
    """

    document: SimulationDocument
    runs: bytes


def simulate(
    progress: Progress,
    experiment: str,
    model: str,
    add: list[str],
    driven_by: ControllerFile | str | None,
    horizons: tuple[float, ...],
) -> PredictedMotion:
    """A model run forward in windows along its record and freely from its start, beside the usual one.

    driven_by : what `identify.simulation.closing` takes for a controller
    horizons  : s, of the windows
    """
    from identify.simulation.free_motion import FreeMotion
    from identify.simulation.simulate import simulated

    kept: list[FreeMotion] = []
    loaded = load_experiment(Path(experiment))
    result = identify.identify(
        loaded, model=model, add=add, progress=lambda done, step: progress(0.2 * done, step)
    )
    usual = None if model == "usual" and not add else identify.identify(loaded, model="usual")
    document = simulated(
        result,
        usual,
        horizons,
        driven_by,
        progress=lambda done, step: progress(0.3 + 0.6 * done, step),
        keep=kept.append,
    )
    return PredictedMotion(document, stored_runs(kept))


def export(progress: Progress, experiment: str, model: str, add: list[str], target: str) -> Certificate:
    """A model written for another program, with its certificate beside it.

    target : the file; its folder is made here
    """
    from identify.export.write import write_export

    result = _identified(progress, experiment, model, add, 0.5)
    progress(0.5, "writing, and loading back what was written")
    Path(target).parent.mkdir(exist_ok=True)
    return write_export(result, Path(target))


def torque_along(
    progress: Progress,
    experiment: str,
    model: str,
    add: list[str],
    rig: Rig,
    plan: ExcitationPlan,
    payload: Payload,
    part: Part,
    share: float,
) -> TorqueAhead:
    """A model's torque along a plan, ready to be sent as feedforward; InputError where that might do harm."""
    from api.compensation import torque_ahead

    result = _identified(progress, experiment, model, add, 0.7)
    progress(0.7, "the torque along the plan")
    return torque_ahead(result, rig, plan, payload, part, share)


def drive_tables(
    progress: Progress, experiment: str, model: str, add: list[str], rig: Rig
) -> DriveTablesDocument:
    """A model's friction and cogging as the drives of a rig take them; nothing is written to the drives."""
    from api.drive_tables import drive_tables as tables_of

    result = _identified(progress, experiment, model, add, 0.7)
    progress(0.7, "choosing support points")
    return tables_of(result, rig)


def _identified(
    progress: Progress, experiment: str, model: str, add: list[str], share: float
) -> Identification:
    """The model that is used; `share` of the job's progress is for it."""
    return identify.identify(
        load_experiment(Path(experiment)),
        model=model,
        add=add,
        progress=lambda done, step: progress(share * done, step),
    )
