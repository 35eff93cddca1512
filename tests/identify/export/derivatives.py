"""Models with derivatives over time, and what the identifier itself makes of them along a record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.estimation.context import Slot, contexts, slot_rows
from identify.export.c_code import c_code
from identify.export.compiled import compiled_torque, compiler_here
from identify.export.document_torque import document_torque
from identify.export.exported_model import Memory, Torque
from identify.export.fmu import fmu
from identify.export.fmu_torque import fmu_torque, has_fmpy
from identify.export.formula_torque import module_of, module_torque
from identify.export.model_document import model_document
from identify.export.record_error import Motion
from identify.export.structured_text import structured_text
from identify.export.structured_text_torque import structured_text_torque
from identify.identification import identify

VALUES = {"elasticity": (2e-6, 3e-6), "backlash": (2e-4, -3e-4), "delay": (-1.3e-3,)}
"""larger than the record's own, so that each column counts"""
CONSTANTS = {"backlash": {"flank_load": 20.0, "rotor_inertia": 0.5}}
TORQUE_ONLY = "gain-saturation"

PERIOD = 1e-3


def fitted_to(plant, *effects):
    """Fitted to the sessions without payload, with the values above."""
    result = identify(plant, "usual", list(effects), payloads=[plant.payloads[0].name])
    return with_values(result, VALUES, CONSTANTS)


def with_values(result, values, constants):
    """An identification whose effects have these values and constants, by name, instead of those found."""
    fitted = result.fitted
    chosen = tuple(
        Slot.of(slot.term, constants[slot.term.effect.name]) if slot.term.effect.name in constants else slot
        for slot in fitted.slots
    )
    fitted = replace(fitted, slots=chosen)
    chi = fitted.fit.chi.copy()
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        chi[columns] = values.get(slot.term.effect.name, chi[columns])
    return replace(result, fitted=replace(fitted, fit=replace(fitted.fit, chi=chi)))


def along_the_record(result, file):
    """The motion of a session, its torque by the identifier's columns, and where the sign of the velocity is its direction."""
    fitted = result.fitted
    entry = next(each for each in result.experiment.sessions if each.file == file)
    (context,) = contexts(fitted.record, entry, fitted.torque)
    torque = context.load.copy()
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        if not slot.term.effect.reported_offset(slot.values):
            for joint, table in slot_rows(context, slot):
                torque[:, joint] += table @ fitted.fit.chi[columns]
    block = context.block
    motion = Motion(block.time - context.session_start, block.q, block.dq, block.ddq, None, entry.payload)
    return motion, torque, (np.sign(block.dq) == block.direction).all(axis=1)


def one_inertia(model, inertia, torques):
    """A model of one joint that is an inertia on a motor's shaft and these torques, by effect: formula, value, derivative."""
    standard = np.zeros(11)
    standard[10] = inertia
    listed = tuple(
        Torque(effect, 0, 0, (formula,), (value,), derivative=order)
        for effect, formula, value, order in torques
    )
    return replace(model, standard=standard, torques=listed)


def with_play(model, gap, value):
    """The same with a link's place in a gap, pushed by motion, whose second derivative has a value."""
    memory = Memory("backlash", 0, "play", gap)
    return replace(
        model, torques=(Torque("backlash", 0, 0, ("-memory",), (value,), memory=memory, derivative=2),)
    )


def sine(payload, time, omega=8.0, amplitude=0.4):
    """Motion of one joint along a sine."""
    q = amplitude * np.sin(omega * time)
    dq, ddq = amplitude * omega * np.cos(omega * time), -(omega**2) * q
    return Motion(time, q[:, None], dq[:, None], ddq[:, None], None, payload)


def in_formats(model, folder, compiled=True, packed=True):
    """By format what computes its torques; C, and the unit made of it, where they are asked for."""
    formats = {"formulas": module_torque(module_of(model), model)}
    (folder / "arm.st").write_text(structured_text(model, "arm"))
    formats["structured text"] = structured_text_torque(folder / "arm.st")
    (folder / "arm.json").write_text(model_document(model).json_text())
    formats["data"] = document_torque(folder / "arm.json")
    if compiled and (compiler := compiler_here()) is not None:
        source, header = c_code(model, "arm")
        (folder / "arm.c").write_text(source)
        (folder / "arm.h").write_text(header)
        formats["C"] = compiled_torque(compiler, folder / "arm.c")
        if packed and has_fmpy():
            (folder / "arm.fmu").write_bytes(fmu(model, "arm", compiler))
            formats["unit"] = fmu_torque(folder / "arm.fmu")
    return formats
