"""What the pages say of proofs on the drive: in one line for lists, in tables by joint, speed and quadrant."""

from dataclasses import dataclass
from urllib.parse import urlencode

from api.pages.layout import experiment_link
from api.pages.number_format import THIN, number
from api.pages.rendering import Context
from api.proof_drive import ORDINAL
from api.service.proofs import ProofState
from api.service.service import Service
from identify.results.compensation import CompensationDocument, JointFollowing

PARTS = {"whole": "the whole model", "friction": "friction alone"}


@dataclass(frozen=True)
class ProofRow:
    """One proof in a list."""

    number: str
    link: str
    model: str
    version: str | None
    part: str
    share: float
    payload: str
    plan: str
    rig: str
    operator: str
    created: str
    tone: str
    words: str
    changes: str


@dataclass(frozen=True)
class FollowingRow:
    """A following error without and with feedforward torque, in mrad or mm, and its change in words."""

    words: str
    without: float | None
    with_torque: float | None
    change: str
    worse: bool


def proof_panel(service: Service, experiment: str, version: str) -> Context:
    """Context of the panel that leads to the proofs of an experiment, and to a new one of a version."""
    proofs = service.proofs.all(experiment)
    return {
        "proofs": [proof_row(experiment, each) for each in proofs[:3]],
        "proofs_link": experiment_link(experiment, "proofs"),
        "drive_tables_link": f"{experiment_link(experiment, 'drive-tables')}?{urlencode({'version': version})}",
        "new_proof_link": f"{experiment_link(experiment, 'proofs')}?{urlencode({'version': version})}",
    }


def proof_row(experiment: str, state: ProofState) -> ProofRow:
    """One proof in a list."""
    settings = state.settings
    tone, outcome = _outcome(state)
    return ProofRow(
        number=state.number,
        link=experiment_link(experiment, f"proofs/{state.number}"),
        model=" + ".join([settings.model, *settings.add]),
        version=settings.version,
        part=PARTS[settings.part],
        share=settings.share,
        payload=settings.payload.name,
        plan=settings.plan,
        rig=settings.rig,
        operator=settings.operator,
        created=settings.created,
        tone=tone,
        words=outcome,
        changes=(changes(state.result) if state.result is not None else ""),
    )


def _outcome(state: ProofState) -> tuple[str, str]:
    """Colour and words of how far a proof is."""
    if state.unfinished is not None and state.next is not None:
        again = "to be run again" if not state.elsewhere else "to be continued on the command line"
        return "warn", f"{ORDINAL[state.unfinished.drive]} run ended early, {again}"
    if state.elsewhere:
        return "idle", "to be continued on the command line"
    if state.result is None:
        return "idle", "to be run without it" if state.next == "without" else "to be run with it"
    if not state.result.completed:
        return "warn", "stopped with feedforward torque"
    worse = [each.joint for each in state.result.joints if not improved(each)]
    if worse:
        return "warn", f"no better: {', '.join(worse)}"
    return "good", "follows better"


def improved(joint: JointFollowing) -> bool:
    """Whether a joint follows better with feedforward torque."""
    return joint.rms_with is not None and joint.rms_without is not None and joint.rms_with < joint.rms_without


def changes(result: CompensationDocument) -> str:
    """What it did to the root mean square of each joint."""
    return ", ".join(f"{each.joint}\u00a0{change(each.rms_without, each.rms_with)}" for each in result.joints)


def change(without: float | None, with_: float | None) -> str:
    """With a sign, in percent, in one piece where a line is broken."""
    if not without or with_ is None:
        return "–"
    percent = 100.0 * (with_ / without - 1.0)
    return f"{'+' if percent > 0 else ''}{number(percent, 0)}{THIN}%"


def joint_rows(joint: JointFollowing) -> list[FollowingRow]:
    """The table of one joint: all of the plan, by speed, by quadrant, and the peak; in mrad or mm."""
    rows = [("root mean square, all of the plan", joint.rms_without, joint.rms_with)]
    rows += [(part.where, part.rms_without, part.rms_with) for part in (*joint.speeds, *joint.quadrants)]
    rows.append(("peak", joint.peak_without, joint.peak_with))
    return [
        FollowingRow(
            words=where,
            without=(None if without is None else 1e3 * without),
            with_torque=(None if with_ is None else 1e3 * with_),
            change=change(without, with_),
            worse=(without is not None and with_ is not None and with_ >= without),
        )
        for where, without, with_ in rows
    ]
