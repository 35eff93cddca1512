"""A certificate speaks of the file as written: a digit that is changed in it changes the figure, and what could not be loaded
back has none."""

from __future__ import annotations

import io
import re
import zipfile
from dataclasses import replace

import pytest

from api.certificate_text import certificate_text
from identify.export import fmu as fmu_module
from identify.export import link_file_torque, loaded_back, write
from identify.export.write import write_export
from identify.identification import identify
from identify.recording import InputError, load_experiment
from tests.plants.single_joint import record, write_experiment


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    recorded = record({"stribeck": 1.0}, seed=5, duration=4.0, payload_masses=(0.0, 4.0))
    plant = write_experiment(tmp_path_factory.mktemp("plant") / "bench", recorded)
    return identify(load_experiment(plant), "usual", ["presliding"])


BEFORE = {
    ".py": r"(total\[0\] \+= \(?)(\d)",
    ".c": r"(torque\[0\] \+= \(?)(\d)",
    ".st": r"(TORQUE\[0\] := TORQUE\[0\] \+ \(?)(\d)",
    ".json": r'("values": \[\s*)(\d)',
    ".urdf": r'(damping=")(\d)',
    ".sdf": r"(<damping>)(\d)",
    ".xml": r'(damping=")(\d)',
}
"""by ending: what stands before a digit of viscous friction"""
READERS = [(ending, False) for ending in BEFORE] + [(ending, True) for ending in link_file_torque.PROGRAMS]


def with_another_digit(content, ending):
    changed, count = re.subn(
        BEFORE[ending], lambda match: f"{match[1]}{(int(match[2]) + 4) % 10}", content, count=1
    )
    assert count == 1
    return changed


@pytest.mark.parametrize(("ending", "no_program"), READERS)
def test_a_digit_that_is_changed_in_the_file_changes_the_certificate(
    result, tmp_path, monkeypatch, ending, no_program
):
    if no_program:
        monkeypatch.setattr(link_file_torque, "program_here", lambda ending: None)
    name = f"arm{ending}"
    right = write_export(result, tmp_path / name)
    maker = "_code" if ending in (".py", ".c", ".st", ".json") else "_link_file"
    make = getattr(write, maker)

    def corrupted(*arguments):
        made = make(*arguments)
        return replace(made, files={**made.files, name: with_another_digit(made.files[name], ending)})

    monkeypatch.setattr(write, maker, corrupted)
    wrong = write_export(result, tmp_path / name)
    assert right.not_measured is wrong.not_measured is None
    assert right.checked_with == wrong.checked_with
    assert ("was not installed" in right.checked_with) is no_program
    (before,), (after,) = right.joints, wrong.joints
    assert after.relative_error_export > before.relative_error_export + 0.01
    disagree = [remark for remark in wrong.remarks if "though the format holds all of it" in remark]
    if maker == "_code":
        assert before.relative_difference < 1e-12
        assert after.relative_difference > 1e-3
        assert len(disagree) == 1
    assert not any("though the format" in remark for remark in right.remarks)


def test_a_unit_whose_source_or_description_is_another_has_another_certificate(result, tmp_path, monkeypatch):
    pytest.importorskip("fmpy", reason="FMPy (extra fmu) is not installed")
    right = write_export(result, tmp_path / "arm.fmu")
    packed = (tmp_path / "arm.fmu").read_bytes()
    make = fmu_module.c_code
    monkeypatch.setattr(
        fmu_module,
        "c_code",
        lambda *arguments: (with_another_digit(make(*arguments)[0], ".c"), make(*arguments)[1]),
    )
    wrong = write_export(result, tmp_path / "arm.fmu")
    assert wrong.joints[0].relative_error_export > right.joints[0].relative_error_export + 0.01
    assert wrong.joints[0].relative_difference > 1e-3
    monkeypatch.setattr(write, "fmu", lambda *arguments: with_another_reference(packed))
    refused = write_export(result, tmp_path / "arm.fmu")
    assert refused.joints[0].relative_error_export is None
    assert "FMPy does not take it" in refused.not_measured


def with_another_reference(packed):
    """A unit that describes its first position by the value reference of its velocity."""
    changed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(packed)) as before, zipfile.ZipFile(changed, "w") as after:
        for name in before.namelist():
            content = before.read(name)
            if name == "modelDescription.xml":
                assert b'name="q1" valueReference="1"' in content
                content = content.replace(b'name="q1" valueReference="1"', b'name="q1" valueReference="2"')
            after.writestr(name, content)
    return changed.getvalue()


def test_without_a_compiler_there_is_no_figure_of_something_else(result, tmp_path, monkeypatch):
    monkeypatch.setattr(loaded_back, "compiler_here", lambda: None)
    certificate = write_export(result, tmp_path / "arm.c")
    assert certificate.joints[0].relative_error_export is None
    assert certificate.joints[0].relative_error_model is not None
    assert certificate.not_measured == loaded_back.NO_COMPILER
    assert "install one and export again" in certificate_text(certificate)
    assert "of the file not measured" in certificate_text(certificate)
    monkeypatch.setattr(loaded_back, "compiler_here", lambda: "false")
    refused = write_export(result, tmp_path / "arm.c")
    assert refused.not_measured.startswith("arm.c: false could not compile it")


@pytest.mark.parametrize(
    ("ending", "text", "said"),
    [
        (
            ".py",
            "import nothing_of_this_name\n",
            r"arm\.py: Python does not take it: ModuleNotFoundError: .*",
        ),
        (".st", "FUNCTION_BLOCK ARM\nY := 1.0;\nEND_FUNCTION_BLOCK\n", r"arm\.st line 2: .*"),
        (".json", "{}\n", r".*arm\.json.*"),
        (".sdf", "<sdf/>\n", r".*arm\.sdf: exactly one <model> .*"),
    ],
)
def test_a_file_that_is_not_what_it_must_be_is_not_written_at_all(
    result, tmp_path, monkeypatch, ending, text, said
):
    name = f"arm{ending}"
    maker = "_link_file" if ending == ".sdf" else "_code"
    made = getattr(write, maker)
    monkeypatch.setattr(write, maker, lambda *arguments: replace(made(*arguments), files={name: text}))
    with pytest.raises(InputError) as refused:
        write_export(result, tmp_path / name)
    assert re.fullmatch(said, str(refused.value))
    assert list(tmp_path.iterdir()) == []
