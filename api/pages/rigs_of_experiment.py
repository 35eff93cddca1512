"""The rigs that have the joints of an experiment."""

from collections.abc import Mapping

from api.pages.stored_models import StoredExperiment
from api.service.service import Service
from daq.rig import Rig
from identify.recording.errors import InputError


def rigs_of_experiment(service: Service, stored: StoredExperiment) -> dict[str, Rig]:
    """By their ids."""
    rigs: dict[str, Rig] = {}
    for each in service.rigs.files():
        try:
            rig = service.rigs.rig(each)
        except InputError:
            continue  # said on the rig's own page
        if [axis.joint for axis in rig.axes] == stored.joint_names:
            rigs[each] = rig
    return rigs


def rig_of_choice(
    service: Service, experiment: str, rigs: Mapping[str, Rig], chosen: str | None
) -> str | None:
    """The rig that is shown: the chosen one, else that of the newest session, else any; None where no rig has the joints."""
    if chosen in rigs:
        return chosen
    measured_on = reversed(service.catalogue.rigs(experiment))
    return next((each for each in measured_on if each in rigs), None) or next(iter(rigs), None)
