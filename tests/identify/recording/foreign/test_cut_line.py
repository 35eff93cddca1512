"""A file that ends inside a number: the last sample is left out and said, all others are as they were written."""

import numpy as np
import pytest

from identify.recording.foreign import read_foreign
from identify.recording.foreign.cut_line import is_cut

TIME = np.arange(40) * 0.002
POSITION = 0.8 * np.sin(9 * TIME + 0.3)

FORMS = {
    "decimals": ("{t:.3f},{q:.6f}\n", "."),
    "decimal comma": ("{t:.3f};{q:.6f}\r\n", ","),
    "powers of ten": ("{t:.3f}\t{q:.7e}\n", "."),
    "whole numbers": ("{t:.3f} {counts}\n", "."),
    "a unit in each cell": ("{t:.3f},{q:.5f} rad\n", "."),
    "a separator at the end": ("{t:.3f};{q:.6f};\n", "."),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("length", [1, 2, 3, 4, 5, 7, 9, 12, 15, 20])
def test_no_sample_is_another_than_was_written(tmp_path, form, length):
    written, decimal = FORMS[form]
    counts = np.round(1e6 * POSITION).astype(int)
    text = "".join(
        written.format(t=t, q=q, counts=c) for t, q, c in zip(TIME, POSITION, counts, strict=True)
    ).replace(".", decimal)
    whole, path = tmp_path / "whole.txt", tmp_path / "cut.txt"
    whole.write_bytes(text.encode())
    left = text[:-length]
    path.write_bytes(left.encode())
    table = read_foreign(path)
    values, expected = table.columns[1].numbers, read_foreign(whole).columns[1].numbers
    assert values is not None
    assert expected is not None
    assert len(values) >= len(TIME) - 2
    np.testing.assert_array_equal(values, expected[: len(values)])
    said = any("cut off at the end of the file" in remark for remark in table.remarks)
    assert said == (len(values) < len(left.splitlines()))


def test_a_whole_file_without_an_end_of_its_last_line_loses_nothing(tmp_path):
    for name, form in (("fixed", "{t:.3f},{q:.6f}"), ("shortest", "{t!r},{q!r}")):
        path = tmp_path / f"{name}.csv"
        lines = [form.format(t=float(t), q=float(q)) for t, q in zip(TIME, POSITION, strict=True)]
        path.write_text("t,q\n" + "\n".join(lines))
        assert len(read_foreign(path).columns[1]) == len(TIME)


@pytest.mark.parametrize(
    ("cell", "above", "cut"),
    [
        ("14:03:00.0", ["14:03:00.002", "14:03:00.004"], True),
        ("14:03:00.006", ["14:03:00.002", "14:03:00.004"], False),
        ("", ["1.5", "1.6"], True),
        ("", ["1.5", ""], False),
        ("-", ["1.5", "1.6"], True),
        ("1.5e-", ["1.5e-3", "1.6e-3"], True),
        ("3", ["", ""], False),
        ("7", ["7"], False),
        ("12", ["1210", "1215", "1220"], True),
        ("1224", ["1210", "1215", "1220"], False),
    ],
)
def test_a_cell_is_judged_by_those_above_it(cell, above, cut):
    assert is_cut(cell, above, ".") is cut
