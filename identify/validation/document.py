"""The document of an identification: the contract's `identify --json`, section 3, and what stands beside it."""

import numpy as np

from identify.estimation.block_errors import block_errors, ratio
from identify.estimation.identified import Identified
from identify.estimation.parameters import column_names
from identify.estimation.small_algebra import single_threaded
from identify.results.effect import EffectOnJoint
from identify.results.identification import (
    EffectConstants,
    ExcludedSession,
    IdentificationDocument,
    JointError,
    SessionError,
    SignalChoice,
    SpeedError,
    StructuredEstimate,
)
from identify.validation.excitation import excitation
from identify.validation.noise_floor import noise_floors
from identify.validation.prior_inertias import compared_with_prior
from identify.validation.relative_error import by_payload, by_speed


@single_threaded
def identification_document(result: Identified) -> IdentificationDocument:
    """The result as a document; a figure that cannot be given is None."""
    fitted, record = result.fitted, result.fitted.record
    training = block_errors(fitted.observation, fitted.fit.chi)
    checked = None if result.validation is None else block_errors(result.validation, fitted.fit.chi)
    files = [entry.file for entry in record.entries()]
    floors = noise_floors(
        record,
        {
            file: np.column_stack([result.predictions[file, joint].residual for joint in record.joint_names])
            for file in files
        },
    )
    described = column_names(fitted)
    squares = session_squares(result)
    entries = [entry for entry in result.experiment.sessions if entry.file in squares]
    structured = None
    if result.structured is not None:
        structured = StructuredEstimate(
            relative_error=result.structured.fitted.fit.relative_error,
            parameters=tuple(parameter.document() for parameter in result.structured_parameters),
        )
    parameters = tuple(parameter.document() for parameter in result.parameters)
    prior = result.experiment.prior
    return IdentificationDocument(
        experiment=result.experiment.name,
        model=result.model,
        effects=tuple(
            EffectOnJoint(effect=term.effect.name, joint=record.joint_names[term.joint])
            for term in result.effects
        ),
        rotors=record.body.base.rotors,
        relative_error=result.relative_error,
        relative_error_validation=result.relative_error_validation,
        joints=tuple(
            JointError(
                joint=name,
                relative_error=ratio(*training[:, joint].sum(0)),
                relative_error_validation=None if checked is None else ratio(*checked[:, joint].sum(0)),
                noise_floor=None if (floor := floors[joint]) is None else floor.value,
                noise_floor_interval=None if floor is None else (floor.low, floor.high),
            )
            for joint, name in enumerate(record.joint_names)
        ),
        sessions=tuple(
            SessionError(
                file=entry.file,
                payload=entry.payload.name,
                role=result.role_of(entry),
                relative_error=ratio(*squares[entry.file]),
                duration=record.facts(entry).duration,
            )
            for entry in entries
        ),
        excluded=tuple(
            ExcludedSession(file=entry.file, payload=entry.payload.name, reason=entry.excluded or "")
            for entry in result.experiment.excluded
        ),
        parameters=parameters,
        condition_number=fitted.fit.condition_number,
        samples=int(fitted.fit.rows.sum()),
        form=result.form,
        estimator=fitted.estimator,
        eliminated=tuple(each.document(*described[each.column][:2]) for each in fitted.eliminated),
        constants=tuple(
            EffectConstants.of(slot.term.effect.name, record.joint_names[slot.term.joint], slot.values)
            for slot in fitted.slots
            if slot.values
        ),
        relative_error_left_out=result.relative_error_left_out,
        payloads=by_payload(
            [(entry, result.role_of(entry), squares[entry.file]) for entry in entries],
            result.unknown_payloads,
        ),
        speeds=speeds(result),
        signals=tuple(
            SignalChoice(name=choice.name, value=choice.value, unit=choice.unit, reason=choice.reason)
            for choice in record.settings.choices
        ),
        not_identifiable=tuple(described[column][0] for column in fitted.fit.dropped),
        remarks=tuple(result.all_remarks),
        excitation=excitation(result),
        structured=structured,
        prior=None if prior is None else compared_with_prior(result, parameters, prior),
    )


def session_squares(result: Identified) -> dict[str, np.ndarray]:
    """By file of every session: squared norms of residual and of measured torque, over all joints."""
    squares = {}
    for observation in (result.fitted.observation, result.validation, result.left_out):
        if observation is not None:
            errors = block_errors(observation, result.fitted.fit.chi)
            for index, entry in enumerate(observation.entries):
                squares[entry.file] = errors[observation.blocks_of(index)].sum(axis=(0, 1))
    return squares


def speeds(result: Identified) -> tuple[SpeedError, ...]:
    """Table III: relative errors at all, low and high speeds."""
    record = result.fitted.record
    top = dict(zip(record.joint_names, record.top_speed.tolist(), strict=True))
    groups = {
        role: [
            result.predictions[entry.file, joint]
            for entry in result.experiment.sessions
            if result.role_of(entry) == role
            for joint in record.joint_names
        ]
        for role in ("identification", "validation")
    }
    return by_speed(groups, top)
