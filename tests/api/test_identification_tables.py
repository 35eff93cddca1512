"""What a reader finds in the tables of an identification: every figure in its row, rounded as it is meant."""

import pytest

from api import identification_tables
from api.identification_tables import (
    NARROWEST,
    console_for_tables,
    errors_of_models,
    print_effects,
    print_identification,
)
from identify.results.identification import IdentificationDocument


def parameter(name, value, std, percent, unit, grouping=None, doubt=None):
    return {
        "name": name,
        "joint": "j3",
        "value": value,
        "std": std,
        "std_robust": None if std is None else 3 * std,
        "relative_std_percent": percent,
        "unit": unit,
        "grouping": grouping,
        "doubt": doubt,
    }


def document(**changes) -> IdentificationDocument:
    """Of one joint, two payloads, one of them in validation."""
    sessions = [
        {"file": "a.csv", "payload": "none", "role": "identification", "relative_error": 0.07},
        {"file": "b.csv", "payload": "disk", "role": "validation", "relative_error": 0.08126},
    ]
    given = {
        "experiment": "rx130l",
        "model": "usual",
        "effects": [{"effect": "viscous", "joint": "j3"}, {"effect": "offset", "joint": "j3"}],
        "relative_error": 0.0733,
        "relative_error_validation": None,
        "joints": [
            {"joint": "j3", "relative_error": 0.0733, "relative_error_validation": None, "noise_floor": 0.031}
        ],
        "sessions": sessions,
        "excluded": [{"file": "c.csv", "payload": "disk", "reason": "loose"}],
        "parameters": [
            parameter("ZZ1R", 30.94567, 0.1449, 0.46812, "kg m^2", "ZZ1 + Ia1"),
            parameter("MX1", -20.5, None, None, "kg m", "MX1", "cannot be"),
        ],
        "condition_number": 31.2345,
        "samples": 6021,
        "form": "linear",
        "estimator": "weighted",
        "eliminated": [],
        "constants": [],
        "relative_error_left_out": None,
        "payloads": [
            {"payload": "none", "mass": 0.0, "role": "identification", "relative_error": 0.07},
            {"payload": "disk", "mass": 6.97, "role": "validation", "relative_error": 0.09},
        ],
        "speeds": [
            {
                "range": "all",
                "from": 0.0,
                "to": 1.0,
                "relative_error": 0.0733,
                "relative_error_validation": 0.08,
                "samples": 6021,
                "joints": [],
            },
            {
                "range": "low",
                "from": 0.0,
                "to": 0.1,
                "relative_error": 0.2,
                "relative_error_validation": None,
                "samples": 812,
                "joints": [],
            },
        ],
        "signals": [{"name": "cut-off", "value": 40.12345, "unit": "Hz", "reason": "by rule"}],
        "not_identifiable": ["MY1R"],
        "remarks": [],
    }
    return IdentificationDocument.model_validate(given | changes)


@pytest.fixture
def printed(capsys, monkeypatch):
    """Lines of the tables, words apart from each other by two blanks or more."""
    monkeypatch.setenv("COLUMNS", "200")

    def lines(made) -> list[list[str]]:
        print_identification(made)
        said = capsys.readouterr().out.splitlines()
        return [[cell.strip() for cell in line.split("  ") if cell.strip()] for line in said if line.strip()]

    return lines


def test_every_figure_stands_in_its_row(printed):
    lines = printed(document())
    assert ["rx130l: model usual"] in lines
    assert ["effects: viscous (j3), offset (j3)"] in lines
    assert ["6021 decimated samples, weighted least squares; condition number 31.2"] in lines
    assert ["j3", "7.33 %", "—", "3.10 %"] in lines
    assert ["all", "7.33 %", "—"] in lines
    assert ["a.csv", "none", "identification", "7.00 %"] in lines
    assert ["b.csv", "disk", "validation", "8.13 %"] in lines
    assert ["c.csv", "disk", "excluded: loose"] in lines
    assert ["all with this payload", "disk", "validation", "9.00 %"] in lines
    assert ["low (0 to 10 %)", "20.00 %", "—", "812"] in lines
    assert ["ZZ1R", "30.946", "0.14", "0.43", "0.468", "kg m^2", "j3", "ZZ1 + Ia1"] in lines
    assert ["MX1 (!)", "-20.5", "kg m", "j3"] in lines
    assert ["cut-off", "40.12", "Hz", "by rule"] in lines
    assert ["MY1R"] in lines
    titles = [line[0] for line in lines if len(line) == 1]
    assert "Remarks" not in titles
    assert not any("Eliminated" in title or "Do not rely" in title for title in titles)


@pytest.mark.parametrize(
    ("estimator", "words"),
    [
        ("robust", "robust estimator"),
        ("instrumental", "instrumental estimator"),
        ("ordinary", "ordinary least squares"),
    ],
)
def test_an_estimator_that_is_no_least_squares_is_not_called_so(printed, estimator, words):
    lines = printed(document(estimator=estimator))
    assert [f"6021 decimated samples, {words}; condition number 31.2"] in lines


def test_one_payload_has_no_row_of_its_own(printed):
    lines = printed(document(payloads=document().model_dump(by_alias=True)["payloads"][:1]))
    assert not any(line[0] == "all with this payload" for line in lines)


@pytest.mark.parametrize(
    ("verdict", "title"),
    [
        ("insufficient", "Do not rely on the parameters"),
        ("partial", "This motion does not determine all of the model"),
        ("sufficient", None),
    ],
)
def test_what_the_motion_does_not_tell_stands_before_the_parameters(printed, verdict, title):
    lines = printed(document(excitation={"verdict": verdict, "cannot_tell": ["MY1R: not seen"]}))
    assert (["MY1R: not seen"] in lines) is (title is not None)
    if title is not None:
        assert lines.index([title]) < lines.index(["Parameters"])


def test_what_was_eliminated_and_what_is_consistent_have_tables(printed):
    eliminated = {
        "name": "MY1R",
        "joint": "j3",
        "relative_std_percent": 140.04,
        "relative_error_before": 0.0733,
        "relative_error_after": 0.0734,
    }
    feasible = {
        "weighted_error_of_estimate": 0.07,
        "weighted_error_of_feasible": 0.0711,
        "base": [{"name": "ZZ1R", "estimate": 30.9, "value": 30.8, "unit": "kg m^2"}],
        "standard": [],
        "remark": "",
    }
    structured = {"relative_error": 0.06, "parameters": [parameter("a", 1.044, 0.01, 1.0, "")]}
    bodies = {"joint": "j3", "unit": "kg m", "std_robust": 0.123}
    prior = {
        "file": "arm.urdf",
        "parameters": [
            {
                **bodies,
                "name": "MX1",
                "by_file": 4.1,
                "identified": 4.6,
                "deviations": 4.0651,
                "rotor": False,
            },
            {**bodies, "name": "ZZ1R", "by_file": 9.0, "identified": 30.0, "deviations": 7.0, "rotor": True},
        ],
        "remarks": ["identified differently: MX1"],
    }
    lines = printed(document(eliminated=[eliminated], feasible=feasible, structured=structured, prior=prior))
    assert ["MY1R", "j3", "140", "7.33 %", "7.34 %"] in lines
    said = " ".join(cell for line in lines for cell in line)
    assert "Nearest physically consistent base parameters (weighted error 7.00 % becomes 7.11 %)" in said
    assert ["ZZ1R", "30.9", "30.8", "kg m^2"] in lines
    assert "One value for each physical parameter (relative error 6.00 %)" in said
    assert ["MX1", "j3", "4.1", "4.6", "0.12", "4.07", "kg m"] in lines
    assert ["ZZ1R", "j3", "9", "30", "0.12", "rotor", "kg m"] in lines
    assert ["identified differently: MX1"] in lines


def test_models_stand_beside_each_other_and_what_none_has_is_left_out(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    other = document(model="load-velocity", relative_error=0.04)
    console_for_tables().print(errors_of_models([document(), other]))
    lines = [line.split("  ") for line in capsys.readouterr().out.splitlines()]
    rows = [tuple(cell.strip() for cell in line if cell.strip()) for line in lines]
    assert [row for row in rows if row and row[0][0] not in "R─"] == [
        ("usual", "load-velocity"),
        ("all sessions of the fit", "7.33 %", "4.00 %"),
        ("low speed", "20.00 %", "20.00 %"),
        ("joint j3", "7.33 %", "7.33 %"),
        ("a.csv, payload none", "7.00 %", "7.00 %"),
        ("b.csv, payload disk", "8.13 %", "8.13 %"),
    ]


def test_without_a_terminal_tables_are_wide_enough(monkeypatch):
    for columns, width in (("40", NARROWEST), ("160", 160)):
        monkeypatch.setenv("COLUMNS", columns)
        assert console_for_tables().width == width
    assert NARROWEST == 100


def test_the_catalogue_is_printed_by_groups_with_what_each_effect_needs(capsys, monkeypatch):
    import identify

    monkeypatch.setenv("COLUMNS", "300")
    catalogue = identify.catalogue()
    print_effects(catalogue)
    said = capsys.readouterr().out.splitlines()
    for effect in catalogue:
        (at,) = [place for place, line in enumerate(said) if line.startswith(f"{effect.effect}   ")]
        assert effect.equation in said[at]
        group = next(line for line in reversed(said[:at]) if line in {each.group for each in catalogue})
        assert group == effect.group
        part = said[at + 1 : at + 8]
        assert not effect.needs or any(line.strip() == "needs " + "; ".join(effect.needs) for line in part)
    assert identification_tables.console_for_tables().width == 300
