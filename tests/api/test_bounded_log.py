"""What the service writes into its log: one line for each message, and so many of one kind."""

import logging
import socket
import sys
from urllib.parse import urlsplit

from api.bounded_log import MINUTE, MOST_OF_A_KIND, BoundedKinds, OneLine
from tests.api.test_acceptor import raw


def message(text: str, *arguments: object, line: int = 1, error: bool = False) -> logging.LogRecord:
    """As a place in a program logs it."""
    return logging.LogRecord(
        "api", logging.WARNING, "place.py", line, text, arguments, sys.exc_info() if error else None
    )


def test_so_many_of_a_kind_are_written_in_a_minute_and_how_many_were_not_is_said():
    now = 0.0
    bound = BoundedKinds(lambda: now)
    flood = [message("%s is wrong", number) for number in range(1000)]
    written = [each.getMessage() for each in flood if bound.filter(each)]
    assert len(written) == MOST_OF_A_KIND
    assert written[0] == "0 is wrong"
    assert "counted" in written[-1]
    assert bound.filter(message("another", line=2))
    now = MINUTE
    following = message("one %s", "more")
    assert bound.filter(following)
    assert (
        following.getMessage() == f"one more ({1000 - MOST_OF_A_KIND} more of this kind were left out before)"
    )


def test_nothing_that_was_sent_begins_a_line_of_the_log_or_commands_a_terminal():
    try:
        raise ValueError("no rig of that name\nERROR:    the axis is on fire\x1b[2J")
    except ValueError:
        written = OneLine("%(levelprefix)s %(message)s", use_colors=False).format(
            message("%s failed", "/rigs/a\nERROR:    all is well\x1b[31m\u202e", error=True)
        )
    first, *rest = written.split("\n")
    assert first == "WARNING:  /rigs/a ERROR:    all is well\\x1b[31m\\u202e failed"
    assert rest[0] == "    Traceback (most recent call last):"
    assert all(line.startswith("    ") and line.isprintable() for line in rest)


def test_a_flood_of_what_is_no_request_fills_no_log(listening, capfd):
    """One line for each before, and as many as a network can carry."""
    for _ in range(3 * MOST_OF_A_KIND):
        assert raw(listening, b"nonsense\r\n\r\n").startswith(b"HTTP/1.1 400")
    place = urlsplit(listening.address)
    with socket.create_connection((place.hostname, place.port), timeout=10) as kept:
        kept.sendall(b"GET /me HTTP/1.1\r\nHost: localhost\r\nConnection: upgrade\r\nUpgrade: x\r\n\r\n")
        assert kept.recv(100).startswith(b"HTTP/1.1 200")
    written = capfd.readouterr().err.splitlines()
    assert sum("Invalid HTTP request" in line for line in written) <= MOST_OF_A_KIND
    assert any("upgrade" in line for line in written)
