"""What a demo's job does, in a process of its own: measures on the simulated arm and fits the first model."""

import secrets
from pathlib import Path

from api.service.computations import FitFound, fit
from api.service.job_process import Progress
from api.service.model_story import ModelStory
from api.service.refit import next_refit
from api.simulated_demo import PAYLOADS, RIG, record
from daq.excitation.excitation_plan import ExcitationPlan
from daq.experiment_folder import open_experiment
from daq.rig import RIGS, Rig

MEASURING = 0.9
"""Share of the time that the sessions take; the rest is the fit's."""


def measure_and_fit(progress: Progress, folder: str, name: str, plan: str, operator: str) -> FitFound:
    """Three payload sessions of one plan, and the usual model fitted to them.

    folder : where the experiment is made; nobody else writes there
    name   : the experiment's
    plan   : file of the plan
    """
    rig = _on_a_bus_of_its_own(Rig.load(RIGS / f"{RIG}.yaml"))
    motion = ExcitationPlan.load(Path(plan))
    experiment = Path(folder)
    experiment.mkdir()
    open_experiment(experiment, rig, name)
    for number, payload in enumerate(PAYLOADS):
        session = f"session {number + 1} of {len(PAYLOADS)}, with {rig.payload(payload).mass:g} kg"
        progress(MEASURING * number / len(PAYLOADS), f"{session}: the drive is checked")

        def moving(driven: float, number: int = number, session: str = session) -> None:
            progress(MEASURING * (number + driven) / len(PAYLOADS), f"{session}: moving")

        record(rig, experiment, motion, payload, operator, moving, provisional=True)
    story = ModelStory(experiment)
    refit = next_refit(story)
    output = story.new_fit_folder(refit.version, refit.fit)
    return fit(
        lambda fraction, step: progress(MEASURING + (1.0 - MEASURING) * fraction, step),
        folder,
        refit.model,
        refit.add,
        str(output),
    )


def _on_a_bus_of_its_own(rig: Rig) -> Rig:
    """The same rig on a virtual channel that nobody else has."""
    bus = rig.bus.model_copy(update={"channel": f"demo-{secrets.token_hex(6)}"})
    return rig.model_copy(update={"bus": bus})
