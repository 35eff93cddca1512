"""What the operating system and python-can say of a bus becomes words of our own, with what to look at."""

import errno

import can
import pytest

from drivers.errors import reason_in_words


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENETDOWN, "the channel is down: the interface was switched off, unplugged, or went bus off"),
        (errno.ENOBUFS, "nobody acknowledges them .* or the bus is at its load limit"),
        (errno.ENODEV, "the channel is not there"),
        (errno.EPERM, "no permission"),
        (errno.EIO, "is it unplugged"),
    ],
)
def test_a_number_is_told_in_our_words_whoever_raises_it(number, words):
    by_library = can.CanOperationError("Failed to transmit", number)
    wrapped = can.CanOperationError("could not read")
    wrapped.__cause__ = OSError(number, "x")
    for error in (OSError(number, "x"), by_library, wrapped):
        with pytest.raises(ValueError, match=words):
            raise ValueError(reason_in_words(error))
        assert "Errno" not in reason_in_words(error)
        assert "Error Code" not in reason_in_words(error)


def test_another_number_is_told_as_the_system_tells_it_and_none_in_one_line():
    assert reason_in_words(OSError(errno.ENOTCONN, "x")) == "Transport endpoint is not connected"
    assert reason_in_words(RuntimeError("two\nlines")) == "two lines"
    assert reason_in_words(RuntimeError()) == "RuntimeError"
