import canopen.emcy
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.emergency import CODES, code_in_words, parse_emergency, register_in_words


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x8611, "0x8611 following error is too large"),
        (0x2315, "0x2315 current at the output"),
        (0x38F0, "0x38F0 voltage"),
        (0x0000, "0x0000 no error"),
        (0x0012, "0x0012 no error"),
        (0xA000, "0xA000 a code that no standard names"),
    ],
)
def test_codes_are_told_by_code_by_class_or_not_at_all(code, words):
    assert code_in_words(code) == words


@given(st.integers(0, 0xFFFF))
def test_every_code_that_canopen_s_table_can_name_we_can_name(code):
    theirs = canopen.emcy.EmcyError(code, 0, b"", 0.0).get_desc()
    if theirs:
        assert "no standard names" not in code_in_words(code)


@pytest.mark.parametrize("code", sorted(CODES))
def test_our_words_lie_in_the_class_that_canopen_s_table_gives_the_code(code):
    theirs = canopen.emcy.EmcyError(code, 0, b"", 0.0).get_desc()
    key = {"Current": ("current", "circuit"), "Voltage": ("voltage",), "Temperature": ("hot", "cold")}.get(
        theirs
    )
    assert key is None or any(word in CODES[code] for word in key)


CLASSES = """
10 generic error|20 current|21 current at the input|22 current inside the drive|23 current at the output|30 voltage
31 mains voltage|32 voltage inside the drive|33 output voltage|40 temperature|41 ambient temperature|42 drive temperature
43 motor or transmission temperature|44 supply temperature|50 drive hardware|51 supply|52 measuring circuits or computer
53 operating unit|54 power section|55 data storage|60 drive software|61 internal software|62 user software|63 parameters
70 additional module|71 power electronics or motor|72 measuring circuits|73 sensor|74 computation circuits
75 communication module|80 monitoring|81 communication|82 protocol|83 torque control|84 velocity control
85 position control|86 positioning|87 synchronisation|88 winding|89 process data monitoring|8A control|90 external error
F0 additional function|FF manufacturer specific
"""
"""CiA 301 table 26 and CiA 402-2 (object 0x603F): upper bytes of error codes"""


@pytest.mark.parametrize("line", CLASSES.strip().replace("\n", "|").split("|"))
def test_a_code_that_is_not_known_itself_is_told_by_its_upper_byte(line):
    upper, _, meaning = line.partition(" ")
    assert code_in_words(int(upper, 16) << 8 | 0xE7) == f"0x{upper}E7 {meaning}"


def test_the_error_register_is_told_bit_by_bit():
    assert register_in_words(0) == "no error"
    assert register_in_words(0x21) == "generic error, device profile specific"


@given(st.binary(max_size=8))
def test_short_emcy_frames_are_read_as_far_as_they_go(data):
    emergency = parse_emergency(7, data, 1.5)
    assert emergency.code == int.from_bytes(data[:2], "little")
    assert emergency.register == (data[2] if len(data) > 2 else 0)
    assert emergency.vendor == data[3:8]
    assert str(emergency).startswith("node 7: 0x")


# As the standards print them: CiA 301 (section 7.2.7.1) and CiA 402-2 (table of error codes).
STANDARD = (
    "0000 2220 2250 2310 2320 2340 3110 3120 3210 3220 3310 4210 4220 4310 5112 5400 5441 6100 6320 7121 7122 7300"
    " 7305 7306 7500 8110 8120 8130 8140 8150 8210 8220 8240 8250 8500 8600 8611 8612 8700 8A00 9000 FF00"
)


def test_the_codes_with_words_of_their_own_are_the_standards():
    assert sorted(CODES) == [int(code, 16) for code in STANDARD.split()]
