import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.index_search import Offer, search

WHEEL = "benchbot_{}-{}-py3-none-any.whl"
FILES = [
    {"url": f"/files/{WHEEL.format('mazes', version)}", "core-metadata": {"sha256": "0"}}
    for version in ("1.10", "1.9", "2.0rc1")
]
ANSWERS = {
    "/json/": '{"projects": [{"name": "Benchbot_Task.Maze"}, {"name": "benchbot-mazes"}, {"name": "maze"}]}',
    "/json/benchbot-task-maze/": '{"files": [{"url": "/files/benchbot_task_maze-1.0.tar.gz"}]}',
    "/json/benchbot-mazes/": json.dumps({"files": FILES}),
    f"/files/{WHEEL.format('mazes', '1.10')}.metadata": (
        "Metadata-Version: 2.1\nName: benchbot-mazes\nSummary: Corridors to get lost in.\n"
        "Keywords: benchbot,environment\n\n"
    ),
    "/html/": '<a href="x/">benchbot-sim-bullet</a><a href="y/">numpy</a>',
    "/html/benchbot-sim-bullet/": (
        '<a href="../../files/benchbot_sim_bullet-1.0-py3-none-any.whl#sha256=0" data-core-metadata="true">it</a>'
    ),
    "/files/benchbot_sim_bullet-1.0-py3-none-any.whl.metadata": "Summary: Robots that bump into mazes\n\n",
    "/none/": "<h1>Hello</h1>",
}


class _Answers(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        if self.path not in ANSWERS:
            self.send_error(404)
            return
        assert self.headers["Authorization"] in (None, "Basic bWU6c2VjcmV0")
        self.send_response(200)
        self.end_headers()
        self.wfile.write(ANSWERS[self.path].encode())

    def log_message(self, *_: object) -> None:
        pass


MAZES = Offer("benchbot-mazes", "environment", "Corridors to get lost in.")
TASK = Offer("benchbot-task-maze", "task")
BULLET = Offer("benchbot-sim-bullet", "simulator", "Robots that bump into mazes")


@pytest.fixture
def url() -> Iterator[str]:
    with ThreadingHTTPServer(("127.0.0.1", 0), _Answers) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://me:secret@127.0.0.1:{server.server_address[1]}"
        server.shutdown()


@pytest.mark.parametrize(
    ("word", "found"),
    [
        ("maze", [MAZES, BULLET, TASK]),
        ("lost in", [MAZES]),
        ("environment", [MAZES]),
        ("simulator", [BULLET]),
        ("task", [TASK]),
        ("numpy", []),
    ],
)
def test_names_kinds_and_summaries_of_either_index_are_searched(url: str, word: str, found: list[Offer]) -> None:
    assert search(word, [f"{url}/json/", f"{url}/html"]) == found


def test_an_index_without_a_list_of_names_is_told(url: str) -> None:
    for address, said in ((f"{url}/none", "offers no list"), (f"{url}/gone", "404"), ("/folder", "no http")):
        with pytest.raises(BenchbotError) as caught:
            search("maze", [address])
        assert said in caught.value.why
