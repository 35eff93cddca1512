"""Effects that the data of an experiment cannot tell apart, and the experiment that would, as the page shows them."""

from dataclasses import dataclass
from math import floor, log10
from urllib.parse import urlencode

from api.pages.catalogue_words import effect_titles
from api.pages.error_figures import JointUnits
from api.pages.layout import experiment_link
from api.pages.number_format import THIN, number, significant
from api.pages.rendering import Context
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import rival_words
from identify.results.diagnosis import JointDiagnosis
from identify.results.next_experiment import NextExperimentDocument, Proposal

HELPS = 1.0
"""Standard deviations of the noise below which an experiment is not worth running."""


@dataclass(frozen=True)
class ProposalRow:
    """A proposed experiment with its figures in words, and where to ask for its plan."""

    proposal: Proposal
    rank: int
    speed_words: str
    range_words: str
    plan_link: str


def rival_effects_context(
    stored: StoredExperiment, shown: ShownModel, diagnosis: JointDiagnosis | None, joint: str
) -> Context:
    """What the panel shows: the rivals in words, and the experiment that was found, or where to ask for it."""
    index = stored.joint_names.index(joint)
    rivals = rival_words(diagnosis.candidates, effect_titles(), diagnosis.missing) if diagnosis else []
    proposed = stored.models.next_experiment(shown.version.id, index) if rivals else None
    link = experiment_link(stored.id, "missing/apart")
    units = JointUnits.of(stored.declared.robot.joints[index].type)
    proposals = [] if proposed is None else _worth_running(proposed, units, f"{link}/plan", joint)
    return {
        "rivals": rivals,
        "found": proposed,
        "proposals": proposals,
        "decides": bool(proposals and proposals[0].proposal.decides),
        "find_link": f"{link}?{urlencode({'joint': joint})}",
        "progress": None,
        "failed": None,
        "begin": True,
    }


def _worth_running(
    proposed: NextExperimentDocument, units: JointUnits, plan_address: str, joint: str
) -> list[ProposalRow]:
    """The proposals with their figures in words; none where no motion separates the rivals."""
    rows = []
    for rank, proposal in enumerate(proposed.proposals, start=1):
        if (proposal.separation or 0.0) < HELPS:
            break  # the best come first
        low, high = proposal.position_from, proposal.position_to
        decimals = max(0, 2 - floor(log10(high - low)))
        rows.append(
            ProposalRow(
                proposal,
                rank,
                speed_words=f"{significant(proposal.speed)}{THIN}{units.speed}",
                range_words=f"{number(low, decimals)} and {number(high, decimals)}{THIN}{units.position}",
                plan_link=f"{plan_address}?{urlencode({'joint': joint, 'proposal': rank})}",
            )
        )
    return rows
