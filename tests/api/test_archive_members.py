"""Archives as Finder, Explorer, Info-ZIP and this product's own folders make them are experiments; others end in one line."""

import io
import zipfile

import pytest

from api.service.accounts import Role
from api.service.archive_members import readings
from identify.recording import load_experiment

UTF8_NAME = 0x800
YAML = """format: 1
name: uploaded
robot:
  gravity: [0.0, -9.81, 0.0]
  joints: [{name: j1, type: revolute, drive_gain: 10.0}]
payloads:
  - {name: none, mass: 0.0}
sessions:
"""
CSV = "t,q1,v1\n" + "".join(f"{0.01 * k:.2f},{0.02 * k % 1:.6f},{k % 7}\n" for k in range(200))


class NamedBytes(zipfile.ZipInfo):
    """A member whose name is written as these bytes, with or without the flag that says UTF-8."""

    def __init__(self, raw, utf8, extra=b""):
        super().__init__(raw.decode("latin-1"))
        self.raw, self.utf8, self.extra = raw, utf8, extra

    def _encodeFilenameFlags(self):
        return self.raw, UTF8_NAME if self.utf8 else 0


def packed(members):
    """A zip archive; members are (name in bytes, flag of UTF-8, content[, extra field])."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as out:
        for raw, utf8, content, *extra in members:
            out.writestr(NamedBytes(raw, utf8, *extra), content)
    return target.getvalue()


def yaml(*files):
    return YAML + "".join(f"  - {{file: '{file}', payload: none}}\n" for file in files)


def by_finder():
    """Archive Utility: UTF-8 without the flag, accents apart, a second tree of resource forks, folder markers."""
    accents_apart = "Prüfstand Süd/".replace("ü", "u\u0308").encode()
    return packed(
        [
            (accents_apart, False, ""),
            (accents_apart + b"experiment.yaml", False, yaml("Messung 1 süß.csv")),
            (accents_apart + "Messung 1 su\u0308ß.csv".encode(), False, CSV),
            (accents_apart + b".DS_Store", False, b"\0\0\0\1Bud1"),
            (accents_apart + b"README.md", False, "# read me"),
            (b"__MACOSX/" + accents_apart + b"._experiment.yaml", False, b"\0\5\x16\7"),
            (b"__MACOSX/._" + accents_apart[:-1], False, b"\0\5\x16\7"),
        ]
    )


def by_explorer():
    """`Send to > compressed folder` of a German Windows: code page 850; capitals as old programs write them."""
    folder = "Prüfstand Süd/".encode("cp850")
    return packed(
        [
            (folder + b"EXPERIMENT.YAML", False, yaml("Messung 1 süß.csv")),
            (folder + "MESSUNG 1 SÜß.CSV".encode("cp850"), False, CSV),
            (folder + b"Thumbs.db", False, b"\xd0\xcf\x11\xe0"),
            (folder + b"README.md", False, "# read me"),
        ]
    )


def by_dotnet():
    """Older .NET: backslashes between the folders, UTF-8 with the flag."""
    return packed(
        [
            ("Prüfstand\\experiment.yaml".encode(), True, yaml("data/Messung 1 süß.csv")),
            ("Prüfstand\\data\\Messung 1 süß.csv".encode(), True, CSV),
            ("Prüfstand\\README.md".encode(), True, "# read me"),
        ]
    )


def by_info_zip():
    """Info-ZIP: a name of question marks, and the true one in the extra field 0x7075."""

    def extra(name):
        content = b"\1\0\0\0\0" + name.encode()
        return (0x7075).to_bytes(2, "little") + len(content).to_bytes(2, "little") + content

    return packed(
        [
            (b"./experiment.yaml", False, yaml("Messung 1 süß.csv")),
            (b"./Messung 1 s??.csv", False, CSV, extra("./Messung 1 süß.csv")),
            (b"./README.md", False, "# read me"),
        ]
    )


@pytest.fixture
def operator(service):
    return service.client(Role.OPERATOR)


def upload(operator, content):
    return operator.post("/experiments/import", files={"file": ("a.zip", content)})


@pytest.mark.parametrize("program", [by_finder, by_explorer, by_dotnet, by_info_zip])
def test_an_archive_of_any_program_is_an_experiment_and_what_was_passed_over_is_said(
    operator, service, program
):
    answer = upload(operator, program())
    assert answer.status_code == 201, answer.text
    experiment = load_experiment(service.service.experiments.folder("uploaded"))
    (entry,) = experiment.sessions
    assert entry.file == "Messung-1-suess.csv"
    assert len(experiment.read(entry).time) == 200
    over = answer.json()["passed_over"]
    assert over[0].replace("\\", "/").endswith("README.md")
    hidden = {by_finder: ["3 hidden files"], by_explorer: ["1 hidden file"]}
    assert over[1:] == hidden.get(program, [])
    assert (
        operator.get(
            f"/experiments/uploaded/recordings/{answer.json()['experiment']['sessions'][0]['id']}"
        ).text
        == CSV
    )


def test_the_folder_of_this_service_comes_back_with_its_notes_and_without_what_is_computed(operator, service):
    upload(operator, packed([(b"experiment.yaml", True, yaml("a b.csv")), (b"a b.csv", True, CSV)]))
    folder = service.service.experiments.folder("uploaded")
    (folder / "notes.yaml").write_text("a-b.csv: Süd, second try\n", encoding="utf-8")
    (folder / "models").mkdir(exist_ok=True)
    (folder / "models" / "story.json").write_text("{}")
    again = packed(
        [
            (f"uploaded/{path.relative_to(folder)}".encode(), True, path.read_bytes())
            for path in sorted(folder.rglob("*"))
            if path.is_file() and not path.name.startswith("job")
        ]
    )
    answer = upload(operator, again).json()
    assert answer["experiment"]["id"] == "uploaded-2"
    assert answer["experiment"]["sessions"][0]["note"] == "Süd, second try"
    assert "uploaded/models/story.json" in answer["passed_over"]


@pytest.mark.parametrize(
    ("members", "words"),
    [
        (
            [(b"a/experiment.yaml", True, yaml("a.csv")), (b"b/experiment.yaml", True, yaml("a.csv"))],
            "2 experiments (a/experiment.yaml, b/experiment.yaml); upload each by itself",
        ),
        (
            [
                (b"experiment.yaml", True, yaml("a.csv")),
                (b"x/a.csv", True, CSV),
                (b"y/a.csv", True, CSV),
            ],
            "'a.csv' is in the archive 2 times (x/a.csv, y/a.csv); keep one",
        ),
        (
            [
                (b"experiment.yaml", True, yaml("ä.csv", "ae.csv")),
                ("ä.csv".encode(), True, CSV),
                (b"ae.csv", True, CSV),
            ],
            "sessions[1].file: two files would be stored as ae.csv; rename one",
        ),
        ([(b"experiment.yaml", True, yaml("a.xlsx")), (b"a.xlsx", True, CSV)], "'a.xlsx' must end in .csv"),
        (
            [(b"experiment.yaml", True, yaml("a.csv")), (b"b.csv", True, CSV)],
            "'a.csv' is not a file of the upload",
        ),
        (
            [
                (b"experiment.yaml", True, yaml("a.csv")),
                (b"a.csv", True, CSV),
                (b"notes.yaml", True, "- 1\n"),
            ],
            "notes.yaml: must map session files to texts",
        ),
    ],
)
def test_an_archive_that_is_not_one_experiment_ends_in_one_line(operator, members, words):
    answer = upload(operator, packed(members))
    assert answer.status_code == 422
    assert words in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]


def test_the_page_says_what_was_passed_over_until_it_is_put_away(operator):
    html = {"Accept": "text/html"}
    content = packed(
        [(b"experiment.yaml", True, yaml("a.csv")), (b"a.csv", True, CSV), (b"<b>.txt", True, "x")]
    )
    answer = operator.post("/pages/experiments/import", files={"file": ("a.zip", content)}, headers=html)
    page = answer.headers["HX-Redirect"]
    for _ in range(2):  # the page is loaded anew when the first model is there
        assert "Not taken from the archive:</strong> &lt;b&gt;.txt." in operator.get(page, headers=html).text
    assert operator.post(f"{page}/passed-over/dismiss", headers=html).status_code == 200
    assert "Not taken" not in operator.get(page, headers=html).text


def field(kind, content):
    return kind.to_bytes(2, "little") + len(content).to_bytes(2, "little") + content


@pytest.mark.parametrize(
    ("extra", "first"),
    [
        (field(0x7075, b"\x01" + bytes(4) + "Maß.csv".encode()), "Maß.csv"),
        (field(0x5455, b"\x01" + bytes(4) + b"times") + field(0x7075, b"\x01" + bytes(4) + b"true"), "true"),
        (field(0x5455, b"\x01" + bytes(4) + b"times"), "a.csv"),
        (field(0x7075, b"\x02" + bytes(4) + b"later version"), "a.csv"),
        (field(0x7075, b"\x01" + bytes(4)), "a.csv"),
        (field(0x7075, b"\x01" + bytes(4) + b"\xff\xfe"), "a.csv"),
        (b"\x75", "a.csv"),
    ],
)
def test_the_name_in_the_unicode_field_goes_before_the_plain_one_where_it_is_one(extra, first):
    member = zipfile.ZipInfo("a.csv")
    member.extra = extra
    assert readings(member)[0] == first
