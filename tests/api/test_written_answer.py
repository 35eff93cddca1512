"""Answers that no framework writes, read by a parser of HTTP."""

import json

import h11
import pytest

from api.written_answer import written_answer


@pytest.mark.parametrize(
    ("status", "kind"),
    [(200, b"application/json"), (414, b"application/problem+json"), (503, b"application/problem+json")],
)
def test_a_parser_reads_what_was_written(status, kind):
    client = h11.Connection(h11.CLIENT)
    client.send(h11.Request(method="GET", target="/", headers=[("Host", "localhost")]))
    client.send(h11.EndOfMessage())
    client.receive_data(written_answer(status, {"detail": "später"}, "Retry-After: 1"))
    head, body, end = client.next_event(), client.next_event(), client.next_event()
    assert head.status_code == status
    fields = dict(head.headers)
    assert fields[b"content-type"] == kind
    assert fields[b"retry-after"] == b"1"
    assert fields[b"x-content-type-options"] == b"nosniff"
    assert json.loads(body.data) == {"detail": "später"}
    assert isinstance(end, h11.EndOfMessage)
    assert client.their_state is h11.MUST_CLOSE
