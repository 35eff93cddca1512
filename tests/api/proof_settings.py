"""What a proof on the drive is asked to do: the whole load-velocity model, at most 60 % of the current limit."""

from api.proof import ProofSettings
from daq.rig import Rig
from identify.recording import Payload


def proof_settings(rig: Rig, experiment: str, payload: Payload) -> ProofSettings:
    """Of the standard plan with this payload."""
    return ProofSettings(
        experiment=experiment,
        rig=rig.name,
        plan="standard plan",
        payload=payload,
        model="load-velocity",
        part="whole",
        share=0.6,
        operator="operator",
        created="2026-11-28T09:00:00+00:00",
    )
