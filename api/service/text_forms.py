"""The forms that names and ids in requests have: each as the expression that is checked, and as the words that a refusal says.

A pattern that a request is checked with stands here, so that nobody is answered with a regular expression.
"""

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$"
SESSION_ID = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"
SMALL_ID = r"^[a-z0-9][a-z0-9_.-]{0,63}$"
USER_NAME = r"^[a-z][a-z0-9._-]{0,63}$"
WITHOUT_SLASHES = r"^[^/\\]+$"
MODEL_ID = r"^m[1-9][0-9]{0,5}$"
MODEL_NUMBER = r"^m[0-9]{1,6}$"
NUMBER = r"^[0-9]{2,6}$"
TOKEN = r"^[0-9a-f]{16}$"
MODEL_NAME = r"^[a-z0-9@+,:=.A-Z_-]+$"
PLANNED_MODEL = r"^[a-z0-9+,@-]+$"
EFFECT = r"^[A-Za-z0-9_.-]+$"
EFFECT_AT_JOINT = r"^[A-Za-z0-9_.-]+(@[^@]+)?$"

_NAMED_MODEL = "must be `rigid`, `usual`, `load-velocity` or `rigid+EFFECT,EFFECT…`, without spaces"

WORDS = {
    NAME: "must be 1 to 64 letters, digits, `_`, `.` and `-` without accents, and begin with a letter or digit",
    SESSION_ID: "must be 1 to 100 letters, digits, `_`, `.` and `-` without accents, and begin with a letter or digit",
    SMALL_ID: "must be 1 to 64 small letters, digits, `_`, `.` and `-` without accents, and begin with a letter or digit",
    USER_NAME: "must be 1 to 64 small letters, digits, `_`, `.` and `-` without accents, and begin with a letter",
    WITHOUT_SLASHES: "must have no `/` and no `\\`",
    MODEL_ID: "must be a model's version: `m` and its number from 1, such as `m2`",
    MODEL_NUMBER: "must be a model's version: `m` and its number, such as `m2`",
    NUMBER: "must be a number of 2 to 6 digits, such as `01`",
    TOKEN: "must be 16 digits of 0 to 9 and a to f, as the service gives them",
    MODEL_NAME: _NAMED_MODEL,
    PLANNED_MODEL: _NAMED_MODEL,
    EFFECT: "must be the name of an effect (GET /effects): letters, digits, `_`, `.` and `-`",
    EFFECT_AT_JOINT: "must be the name of an effect (GET /effects), or EFFECT@JOINT",
}
"""what would be right, by pattern"""


def words_of(pattern: str) -> str:
    """What a text that does not match a pattern should be."""
    return WORDS.get(pattern, "has characters that cannot stand here")
