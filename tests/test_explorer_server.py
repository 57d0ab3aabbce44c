"""The page answers who has its link, from this machine, and nobody else; the newest movement wins."""

import contextlib
import json
import random
import socket
import time
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import pytest
from commands import FIXED, FREE, call
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from jaxgear.explorer import Explorer, Page

TOKEN = "of-a-test-that-knows-it"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    (folder / "pair.toml").write_text(FREE)
    shown = Page(Explorer(folder / "pair.toml"), token=TOKEN)
    shown.start()
    yield shown
    shown.close()


def at(page, path="/", token=TOKEN, **headers):
    """Status and body of a request."""
    address = urlsplit(page.link)
    request = urllib.request.Request(f"http://{address.netloc}{path}?token={token}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as refused:
        return refused.code, refused.read().decode()


@contextlib.contextmanager
def opened(page, token=TOKEN, **options):
    """A WebSocket that has been told to start."""
    address = f"ws://{urlsplit(page.link).netloc}/answers?token={token}"
    with connect(address, max_size=None, **options) as websocket:
        message = json.loads(websocket.recv(timeout=120))
        while message["kind"] == "stage":
            message = json.loads(websocket.recv(timeout=120))
        assert message["kind"] == "start"
        yield websocket


def asked(websocket, message, *kinds):
    """First answer of these kinds to a message."""
    websocket.send(message if isinstance(message, str) else json.dumps(message))
    while True:
        answer = json.loads(websocket.recv(timeout=120))
        if answer["kind"] in kinds:
            return answer


def test_the_page_is_for_who_has_the_link(page):
    assert at(page)[0] == 200
    for token in ("", "another", TOKEN[:-1], TOKEN + "x"):
        assert at(page, token=token)[0] == 403
        with pytest.raises(InvalidStatus, match="403"), opened(page, token=token):
            pass
    assert at(page, "/plotly.js", token="")[0] == 200  # fixed files say nothing
    assert at(page, "/report/pair")[0] == at(page, "/report/..%2Fpair.toml")[0] == at(page, "/../pair.toml")[0] == 404


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "[::2]:80"])
def test_another_host_is_refused(page, host):
    """A name of somebody else that leads to this machine (DNS rebinding)."""
    assert at(page, Host=host) == (403, "unknown Host")


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1", "https://{host}", "http://{host}.evil"]
)
def test_another_origin_is_refused(page, origin):
    origin = origin.format(host=urlsplit(page.link).netloc)
    assert at(page, Origin=origin) == (403, "foreign Origin")
    with pytest.raises(InvalidStatus, match="403"), opened(page, origin=origin):
        pass


def test_its_own_origin_is_let_in_by_every_name_of_this_machine(page):
    port = urlsplit(page.link).port
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", f"[::1]:{port}"):
        assert at(page, Host=host, Origin=f"http://{host}")[0] == 200
    with opened(page, origin=f"http://127.0.0.1:{port}"):
        pass


def test_scripts_of_others_are_not_run(page):
    with urllib.request.urlopen(page.link, timeout=10) as answer:
        policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "script-src 'self';" in policy


@pytest.mark.parametrize(
    ("text", "of", "message"),
    [
        ("{", "message", "not JSON"),
        ("[" * 60000, "message", "not JSON"),
        ("[]", "message", "must be an object with a kind"),
        ('{"kind": "move", "values": [1]}', "message", "must be an object"),
        ('{"kind": "delete"}', "kind", "must be one of move, rest, stop, robust, optimize, save, report"),
        (
            '{"kind": "move", "values": {"height": 1e9}}',
            "move",
            "height = 1e+09 um must be at least 0 um and at most 20 um",
        ),
        ('{"kind": "move", "values": {"height": NaN}}', "move", "height = nan um must be"),
        ('{"kind": "rest", "values": {"height": null}}', "rest", "height: must be a number"),
        ('{"kind": "save", "name": "../../evil"}', "save", "name: must be letters, digits, spaces"),
        ('{"kind": "save", "name": "/etc/evil"}', "save", "name: must be letters, digits, spaces"),
        ('{"kind": "report", "name": "pair"}', "report", "name: pair.toml exists already"),
        ('{"kind": "robust"}', "robust", "manufactured gears need the table [tolerance]"),
        ('{"kind": "optimize", "objective": "noise"}', "optimize", "noise: unknown objective"),
    ],
)
def test_bad_messages_get_one_line_and_the_page_goes_on(page, text, of, message):
    with opened(page) as websocket:
        answer = asked(websocket, text, "refused")
        assert answer["of"] == of and answer["text"].startswith(message) and "\n" not in answer["text"]
        assert asked(websocket, {"kind": "move", "number": 2}, "move")["number"] == 2
    assert sorted(each.name for each in page.explorer.folder.iterdir()) == ["pair.toml"]


def test_a_message_of_100_mb_ends_its_connection_alone(page):
    with opened(page) as other:
        with pytest.raises((ConnectionClosed, OSError)), opened(page) as websocket:
            websocket.send("x" * 100_000_000)
            websocket.recv(timeout=60)
        assert asked(other, {"kind": "move", "number": 1}, "move")["number"] == 1


def test_the_newest_movement_wins_and_tabs_do_not_mix(page):
    draw = random.Random(1)
    with opened(page) as one, opened(page) as other:
        last = {}
        for number in range(1, 401):
            last = {"height": draw.uniform(0.0, 20.0)}
            one.send(json.dumps({"kind": "move", "number": number, "values": last}))
            if number == 200:
                other.send(json.dumps({"kind": "move", "number": 7, "values": {"height": 3.0}}))
        numbers = []
        while not numbers or numbers[-1] != 400:
            answer = json.loads(one.recv(timeout=60))
            numbers.append(answer["number"])
        assert numbers == sorted(numbers) and len(numbers) < 400  # what was overtaken is not worked out
        values = page.explorer.opened.check(last)
        assert answer["numbers"] == page.explorer.move(values)["numbers"]
        there = json.loads(other.recv(timeout=60))
        assert there["number"] == 7
        assert there["numbers"] == page.explorer.move(page.explorer.opened.check({"height": 3.0}))["numbers"]


def test_a_search_is_stopped_on_request(page):
    with opened(page) as websocket:
        websocket.send(json.dumps({"kind": "optimize", "objective": "ppte"}))
        assert asked(websocket, {"kind": "stop"}, "optimized") == {"kind": "optimized", "values": None}


def test_an_address_that_is_taken_is_one_line(page):
    with pytest.raises(ValueError, match="cannot be listened on: "):
        Page(page.explorer, port=urlsplit(page.link).port)


def test_the_command_refuses_before_it_listens(tmp_path):
    (tmp_path / "pair.toml").write_text(FIXED.replace("[load]", "[laod]"))
    result = call("explore", tmp_path / "pair.toml", "--no-browser")
    assert result.code == 2 and len(result.err.splitlines()) == 1 and "laod" in result.err
    (tmp_path / "good.toml").write_text(FIXED)
    result = call("explore", tmp_path / "good.toml", "--no-browser", "--token", "short")
    assert result.code == 2 and "--token has 5 characters, must have at least 16" in result.err


def test_a_notebook_shows_the_page(page, tmp_path, monkeypatch):
    import jaxgear

    monkeypatch.setattr(Explorer, "prepare", lambda self, stage: None)
    monkeypatch.setattr(Explorer, "prepare_rest", lambda self: None)
    (tmp_path / "pair.toml").write_text(FIXED)
    shown = jaxgear.explore(tmp_path / "pair.toml")
    assert (
        shown._repr_html_().startswith(f'<iframe src="{shown.link}"') and urlsplit(shown.link).hostname == "127.0.0.1"
    )
    shown.close()
    with pytest.raises(OSError), socket.create_connection(("127.0.0.1", urlsplit(shown.link).port), timeout=1):
        time.sleep(0)
