"""Effects that the data of an experiment cannot tell apart, and the experiment that would, as the page shows them."""

from collections.abc import Mapping
from math import floor, log10
from typing import Any
from urllib.parse import urlencode

from api.pages.catalogue_words import effect_titles
from api.pages.error_figures import JointUnits
from api.pages.layout import experiment_link
from api.pages.number_format import THIN, number, significant
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import rival_words

HELPS = 1.0
"""Standard deviations of the noise below which an experiment is not worth running."""


def rival_effects_context(
    stored: StoredExperiment, shown: ShownModel, diagnosis: Mapping[str, Any] | None, joint: str
) -> dict[str, Any]:
    """What the panel shows: the rivals in words, and the experiment that was found, or where to ask for it."""
    index = stored.joint_names.index(joint)
    rivals = rival_words(diagnosis["candidates"], effect_titles(), diagnosis["missing"]) if diagnosis else []
    found = stored.models.next_experiment(shown.version.id, index) if rivals else None
    link = experiment_link(stored.id, "missing/apart")
    units = JointUnits.of(stored.declared.robot.joints[index].type)
    proposals = _worth_running(found, units)
    for row in proposals:
        row["plan_link"] = f"{link}/plan?{urlencode({'joint': joint, 'proposal': row['rank']})}"
    return {
        "rivals": rivals,
        "found": found,
        "proposals": proposals,
        "decides": bool(proposals and proposals[0]["decides"]),
        "find_link": f"{link}?{urlencode({'joint': joint})}",
        "progress": None,
        "failed": None,
        "begin": True,
    }


def _worth_running(found: Mapping[str, Any] | None, units: JointUnits) -> list[dict[str, Any]]:
    """The proposals with their figures in words; none where no motion separates the rivals."""
    rows = []
    for rank, proposal in enumerate((found or {}).get("proposals", []), start=1):
        if (proposal["separation"] or 0.0) < HELPS:
            break  # the best come first
        low, high = proposal["position_from"], proposal["position_to"]
        decimals = max(0, 2 - floor(log10(high - low)))
        words = {
            "rank": rank,
            "speed_words": f"{significant(proposal['speed'])}{THIN}{units.speed}",
            "range_words": f"{number(low, decimals)} and {number(high, decimals)}{THIN}{units.position}",
        }
        rows.append(dict(proposal) | words)
    return rows
