"""The server of the live page: who may look on and ask, how many, and what is told to whom."""

from __future__ import annotations

import http.client
import json
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

import pytest

from hil.look.live.broadcast import Broadcast
from hil.look.live.server import MOST_STREAMS, LiveServer
from hil.look.pages import live_page

if TYPE_CHECKING:
    from collections.abc import Iterator

TOKEN: Final = "A" * 22
PAGE: Final = b"<!DOCTYPE html><title>page</title>"


class Served:
    """A server, what it tells, and what was asked of it."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.broadcast = Broadcast(alive=0.02)
        self.server = LiveServer(PAGE, self.broadcast, {"stop": self._stop}, token=TOKEN)
        self.host = urlsplit(self.server.url).netloc

    def _stop(self) -> dict[str, Any]:
        self.asked.append("stop")
        return {"confirmed": True}

    def request(
        self, path: str, method: str = "GET", body: bytes | None = None, **headers: str
    ) -> tuple[int, bytes, dict[str, str]]:
        """Ask as a browser would, but for what is said otherwise."""
        connection = http.client.HTTPConnection(self.host, timeout=10)
        try:
            connection.request(method, path, body, {"Host": self.host, **headers})
            answer = connection.getresponse()
            return answer.status, answer.read(), dict(answer.getheaders())
        finally:
            connection.close()

    @contextmanager
    def stream(self) -> Iterator[http.client.HTTPResponse]:
        """Listen."""
        connection = http.client.HTTPConnection(self.host, timeout=10)
        connection.request("GET", f"/{TOKEN}/told", headers={"Host": self.host})
        response = connection.getresponse()
        try:
            yield response
        finally:
            response.close()
            connection.close()


@pytest.fixture
def served() -> Iterator[Served]:
    made = Served()
    yield made
    made.broadcast.end('"over"')
    made.server.close()


def event(response: http.client.HTTPResponse) -> tuple[str, str]:
    """The next event of a stream."""
    lines = [response.readline().decode().rstrip("\n") for _ in range(3)]
    assert lines[2] == ""
    return lines[0].removeprefix("event: "), lines[1].removeprefix("data: ")


def test_the_page_is_given_to_who_knows_the_token(served: Served) -> None:
    status, content, headers = served.request(f"/{TOKEN}/")
    assert (status, content) == (200, PAGE)
    assert headers["Cache-Control"] == "no-store"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Content-Security-Policy"] == "frame-ancestors 'none'"
    assert "Python" not in headers["Server"]


@pytest.mark.parametrize(
    "path", ["/", "/told", f"/{TOKEN}", f"/{TOKEN[:-1]}/", f"/{TOKEN}A/", f"/{TOKEN}/other", "/%C3%A9/", "//"]
)
def test_nothing_is_given_to_who_does_not(served: Served, path: str) -> None:
    status, content, headers = served.request(path)
    assert status == 404
    assert PAGE not in content
    assert headers["Cache-Control"] == "no-store"


def test_a_token_has_128_bits_and_no_two_are_alike() -> None:
    servers = [LiveServer(PAGE, Broadcast(), {}) for _ in range(2)]
    tokens = {server.token for server in servers}
    for server in servers:
        server.close()
    assert len(tokens) == 2
    assert all(len(token) >= 128 / 6 for token in tokens)


@pytest.mark.parametrize("host", ["example.invalid", "example.invalid:80", "127.0.0.1", ""])
def test_a_name_that_is_not_ours_is_refused(served: Served, host: str) -> None:
    assert served.request(f"/{TOKEN}/", Host=host)[0] == 421
    assert served.request(f"/{TOKEN}/stop", "POST", Host=host, Origin=f"http://{host}")[0] == 421
    assert not served.asked


@pytest.mark.parametrize("origin", ["http://example.invalid", "null", "https://127.0.0.1", "http://127.0.0.1:1"])
def test_a_page_that_is_not_ours_is_refused(served: Served, origin: str) -> None:
    assert served.request(f"/{TOKEN}/", Origin=origin)[0] == 403
    assert served.request(f"/{TOKEN}/stop", "POST", Origin=origin)[0] == 403
    assert not served.asked


def test_what_is_asked_for_has_to_say_where_it_comes_from(served: Served) -> None:
    assert served.request(f"/{TOKEN}/stop", "POST")[0] == 403
    assert served.request(f"/{TOKEN}/stop")[0] == 404  # nothing is done by a link
    assert not served.asked


def test_the_list_of_what_may_be_asked_for_is_closed(served: Served) -> None:
    ours = f"http://{served.host}"
    status, content, headers = served.request(f"/{TOKEN}/stop", "POST", Origin=ours)
    assert (status, json.loads(content), headers["Cache-Control"]) == (200, {"confirmed": True}, "no-store")
    assert served.request(f"/{TOKEN}/start", "POST", Origin=ours)[0] == 404
    assert served.request("/B/stop", "POST", Origin=ours)[0] == 404
    assert served.request(f"/{TOKEN}/stop", "PUT", Origin=ours)[0] == 501
    assert served.request(f"/{TOKEN}/stop", "POST", b"x" * 2000, Origin=ours)[0] == 413
    assert served.asked == ["stop"]


def test_who_comes_late_is_told_what_there_was(served: Served) -> None:
    served.broadcast.commit('{"number": 1}')
    served.broadcast.commit('{"number": 2}')
    served.broadcast.show('{"number": 3}')
    with served.stream() as stream:
        assert stream.getheader("Content-Type") == "text/event-stream"
        assert stream.getheader("Cache-Control") == "no-store"
        assert event(stream) == ("begin", "{}")
        assert [event(stream)[1] for _ in range(3)] == ['{"number": 1}', '{"number": 2}', '{"number": 3}']
        served.broadcast.show('{"number": 4}')
        assert event(stream) == ("part", '{"number": 4}')
        served.broadcast.end('"gone"')
        assert event(stream) == ("over", '"gone"')
        assert stream.read() == b""


def test_of_parts_that_stand_instead_of_each_other_the_last_is_kept(served: Served) -> None:
    for number in range(6):
        served.broadcast.commit(str(number), instead=number not in {0, 3})
    with served.stream() as stream:
        assert [event(stream) for _ in range(3)] == [("begin", "{}"), ("part", "2"), ("part", "5")]
        served.broadcast.commit("6", instead=True)
        assert event(stream) == ("part", "6")


def test_the_fifth_stream_is_told_that_there_is_no_room_and_the_stop_goes_through(served: Served) -> None:
    with served.stream() as one, served.stream() as two, served.stream() as three, served.stream() as four:
        assert [event(stream)[0] for stream in (one, two, three, four)] == ["begin"] * MOST_STREAMS
        with served.stream() as fifth:
            assert event(fifth) == ("full", str(MOST_STREAMS))
            assert fifth.read() == b""
        assert served.request(f"/{TOKEN}/stop", "POST", Origin=f"http://{served.host}")[0] == 200
    assert served.asked == ["stop"]


def test_somebody_who_has_gone_makes_room(served: Served) -> None:
    for _ in range(2 * MOST_STREAMS):
        with served.stream() as stream:
            assert event(stream)[0] == "begin"
        served.broadcast.wait_for_last(10.0)


def test_the_live_page_may_ask_its_own_server_and_nobody_else() -> None:
    page = live_page(lockstep=True).decode()
    assert "default-src 'none'; connect-src 'self'; script-src" in page
    assert '{"live": {"lockstep": true, "robotSide": false}}' in page
    assert 'id="stop"' in page


def test_what_is_asked_for_now_is_told_to_who_comes_late_and_when_it_changes(served: Served) -> None:
    served.broadcast.ask('{"text": "one"}')
    with served.stream() as stream:
        assert [event(stream) for _ in range(2)] == [("begin", "{}"), ("asked", '{"text": "one"}')]
        served.broadcast.commit("{}")
        served.broadcast.ask('{"text": "two"}')
        told = [event(stream)]
        while told[-1] != ("asked", '{"text": "two"}'):
            told.append(event(stream))
        assert told.count(("asked", '{"text": "one"}')) == 0
