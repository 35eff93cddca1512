"""The error register (0x1001) that goes with an emergency error code, CiA 301 sections 7.2.7.1 and 7.5.2.2."""

_GENERIC, _CURRENT, _VOLTAGE, _TEMPERATURE, _COMMUNICATION, _DEVICE_PROFILE = (
    0x01,
    0x02,
    0x04,
    0x08,
    0x10,
    0x20,
)
_OF_CLASS = {0x2: _CURRENT, 0x3: _VOLTAGE, 0x4: _TEMPERATURE}
"""by the first digit of a code"""


def error_register(code: int) -> int:
    """The register's bits for an error code; the generic bit is set with every error."""
    group = code >> 8
    if group in (0x75, 0x81, 0x82):
        return _GENERIC | _COMMUNICATION
    if 0x83 <= group <= 0x8A:
        return _GENERIC | _DEVICE_PROFILE
    return _GENERIC | _OF_CLASS.get(code >> 12, 0)
