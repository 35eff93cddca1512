"""The model as a functional mock-up unit: FMI 3.0, co-simulation, sources and a binary of the same C."""

from __future__ import annotations

import hashlib
import io
import platform
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from html import escape
from importlib.metadata import version
from pathlib import Path
from xml.etree import ElementTree

from identify.export.c_code import c_code, c_name
from identify.export.compiled import compile_library
from identify.export.exported_model import ExportedModel
from identify.export.expression_code import one_line
from identify.export.fmi_source import ValueReferences, fmi_source

UNITS: Mapping[str, Mapping[str, str]] = {
    "s": {"s": "1"},
    "rad": {"rad": "1"},
    "rad/s": {"rad": "1", "s": "-1"},
    "rad/s2": {"rad": "1", "s": "-2"},
    "m": {"m": "1"},
    "m/s": {"m": "1", "s": "-1"},
    "m/s2": {"m": "1", "s": "-2"},
    "N.m": {"kg": "1", "m": "2", "s": "-2"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
    "degC": {"K": "1", "offset": "273.15"},
    "kg": {"kg": "1"},
    "kg.m": {"kg": "1", "m": "1"},
    "kg.m2": {"kg": "1", "m": "2"},
}
"""unit by name: exponents of the base units (FMI 3.0, 2.4.4)"""

PAYLOAD = ("XX", "XY", "XZ", "YY", "YZ", "ZZ", "MX", "MY", "MZ", "M")
WARM = "20"
"""°C where nothing else is set"""

ONLY_WHAT_IS_SHOWN = "-fvisibility=hidden"
"""the library gives the functions of the standard alone: two units of one file name, loaded into one program, would otherwise
call each other's model"""

PACKED = (1980, 1, 1, 0, 0, 0)
"""the earliest date of a ZIP archive, for all entries: the same model is packed into the same file"""


def fmu(model: ExportedModel, stem: str, compiler: str | None) -> bytes:
    """The packed unit; without a compiler it has sources and no binary.

    Raises InputError: the compiler refuses the sources.
    """
    prefix = c_name(stem)
    source, header = c_code(model, prefix)
    token = hashlib.sha256(f"{fmi_source(prefix, '', model.latency)}{header}{source}".encode()).hexdigest()[
        :32
    ]
    sources = {
        f"{prefix}.c": source,
        f"{prefix}.h": header,
        f"{prefix}_fmi3.c": fmi_source(prefix, token, model.latency),
    }
    files: dict[str, bytes] = {
        "modelDescription.xml": _model_description(model, prefix, token),
        "sources/buildDescription.xml": _build_description(prefix),
        "documentation/index.html": _page(model).encode(),
        **{f"sources/{name}": text.encode() for name, text in sources.items()},
    }
    if compiler is not None:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in sources.items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            library = Path(folder) / f"{prefix}{library_ending()}"
            compile_library(
                compiler,
                [Path(folder) / name for name in sources if name.endswith(".c")],
                library,
                ONLY_WHAT_IS_SHOWN,
            )
            files[f"binaries/{platform_name()}/{library.name}"] = library.read_bytes()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, PACKED)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def platform_name() -> str:
    """This computer's folder of binaries: architecture and system (FMI 3.0, 2.5.1.4.1)."""
    architecture = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    system = {"win32": "windows"}.get(sys.platform, sys.platform)
    return f"{architecture}-{system}"


def library_ending() -> str:
    """Of a shared library on this computer."""
    return {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")


def _model_description(model: ExportedModel, prefix: str, token: str) -> bytes:
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=one_line(f"{model.experiment} {model.name}"),
        instantiationToken=token,
        description="Inverse dynamics: the torque that the motors must give for a motion; SI units, joint space",
        generationTool=f"coulomb {version('coulomb')}",
        variableNamingConvention="flat",
    )
    ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=prefix,
        canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
    )
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for name, exponents in UNITS.items():
        ElementTree.SubElement(ElementTree.SubElement(units, "Unit", name=name), "BaseUnit", dict(exponents))
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stepSize="0.001")
    variables = ElementTree.SubElement(root, "ModelVariables")
    ElementTree.SubElement(
        variables,
        "Float64",
        name="time",
        valueReference="0",
        causality="independent",
        variability="continuous",
        unit="s",
    )
    references = ValueReferences(model)
    prismatic = [bool(each) for each in model.geometry.prismatic]

    def add(name: str, reference: int, description: str, unit: str | None, **more: str) -> None:
        shown = {"name": name, "valueReference": str(reference), "description": description, **more}
        element = ElementTree.SubElement(variables, "Float64", shown)
        if unit is not None:
            element.set("unit", unit)

    inputs = (
        ("q", "position", references.q, ("rad", "m"), "0"),
        ("dq", "velocity", references.dq, ("rad/s", "m/s"), "0"),
        ("ddq", "acceleration", references.ddq, ("rad/s2", "m/s2"), "0"),
        ("temperature", "temperature", references.temperature, ("degC", "degC"), WARM),
    )
    for name, what, listed, (turning, sliding), start in inputs:
        for joint, reference in enumerate(listed):
            sentence = f"{what} of joint {one_line(model.geometry.names[joint])}"
            unit = sliding if prismatic[joint] else turning
            add(
                f"{name}{joint + 1}",
                reference,
                sentence,
                unit,
                causality="input",
                variability="continuous",
                start=start,
            )
    for name, reference in zip(PAYLOAD, references.payload, strict=True):
        unit = "kg" if name == "M" else "kg.m" if name.startswith("M") else "kg.m2"
        sentence = f"{name} of a body on the last link, about its frame's origin"
        add(
            f"payload_{name}",
            reference,
            sentence,
            unit,
            causality="parameter",
            variability="fixed",
            start="0",
        )
    for joint, reference in enumerate(references.torque):
        sentence = (
            f"torque of joint {one_line(model.geometry.names[joint])}: current reference times drive gain"
            + (f", for the motion {model.latency} steps before" if model.latency else "")
        )
        unit = "N" if prismatic[joint] else "N.m"
        add(
            f"torque{joint + 1}",
            reference,
            sentence,
            unit,
            causality="output",
            variability="continuous",
            initial="calculated",
        )
    for index, (each, reference) in enumerate(zip(model.memories, references.states, strict=True)):
        bounds = "place in the gap, -0.5 to 0.5" if each.kind == "play" else "-1 to 1"
        sentence = f"state of {each.effect} of joint {one_line(model.geometry.names[each.row])}, {bounds}"
        add(
            f"state{index + 1}",
            reference,
            sentence,
            None,
            causality="local",
            variability="continuous",
            initial="calculated",
        )
    structure = ElementTree.SubElement(root, "ModelStructure")
    for kind in ("Output", "InitialUnknown"):
        for reference in references.torque:
            ElementTree.SubElement(structure, kind, valueReference=str(reference))
    return _xml(root)


def _build_description(prefix: str) -> bytes:
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=prefix)
    files = ElementTree.SubElement(configuration, "SourceFileSet", language="C99")
    for name in (f"{prefix}.c", f"{prefix}_fmi3.c"):
        ElementTree.SubElement(files, "SourceFile", name=name)
    if sys.platform != "win32":
        ElementTree.SubElement(configuration, "Library", name="m", description="the C library's mathematics")
    return _xml(root)


def _page(model: ExportedModel) -> str:
    joints = "".join(f"<li>{escape(one_line(name))}</li>" for name in model.geometry.names)
    when = "the inputs as they stand, at any time"
    if model.latency:
        when = (
            f"the motion {model.latency} steps before: derivatives over time are differences between a motion's neighbours. Give"
            f" the planned motion {model.latency} steps ahead"
        )
    remarks = "".join(f"<p>{escape(one_line(remark))}</p>" for remark in model.remarks)
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escape(one_line(model.experiment))}</title></head><body>
<h1>Inverse dynamics of {escape(one_line(model.experiment))}, model {escape(one_line(model.name))}</h1>
<p>Inputs q, dq, ddq and temperature of each joint, output its torque: what the motor must give, as the current reference
times the drive gain. SI units, joint space. Inputs set before a step are taken to hold at its end; the torque is that of
{when}. Time counts from the moment when the machine begins to move.</p>
<p>The payload is a body on the last link; its ten parameters are zero where there is none.</p>
<p>Joints from the base:</p><ol>{joints}</ol>{remarks}
</body></html>
"""


def _xml(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
