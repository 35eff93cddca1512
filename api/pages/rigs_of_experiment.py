"""The rigs that have the joints of an experiment."""

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
