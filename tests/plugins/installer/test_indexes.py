import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.indexes import Indexes, search, without_credentials


def test_secrets_are_left_out_of_what_is_printed_and_of_the_options_of_processes() -> None:
    assert without_credentials("see https://me:secret@example.org/simple/ and http://token@x/") == (
        "see https://example.org/simple/ and http://x/"
    )
    indexes = Indexes("https://me:secret@example.org/simple", ("https://t@two/",), offline=True, links=(Path("w"),))
    assert indexes.options() == ["--no-index", "--find-links", str(Path("w").absolute())]
    assert indexes.variables("A", "B") == {"A": indexes.url, "B": "https://t@two/"}


ANSWERS = {
    "/json/": ('{"projects": [{"name": "Benchbot_Task.Maze"}, {"name": "benchbot-mazes"}, {"name": "maze"}]}', "json"),
    "/html/": ('<a href="x/">benchbot-task-maze</a><a href="y/">numpy</a>', "html"),
    "/none/": ("<h1>Hello</h1>", "html"),
}


class _Answers(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        if self.path not in ANSWERS:
            self.send_error(404)
            return
        assert self.headers["Authorization"] in (None, "Basic bWU6c2VjcmV0")
        self.send_response(200)
        self.end_headers()
        self.wfile.write(ANSWERS[self.path][0].encode())

    def log_message(self, *_: object) -> None:
        pass


def test_names_are_found_in_either_list_and_an_index_without_is_told() -> None:
    with HTTPServer(("127.0.0.1", 0), _Answers) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        url = f"http://me:secret@127.0.0.1:{server.server_address[1]}"
        assert search("maze", [f"{url}/json/", f"{url}/html"]) == ["benchbot-mazes", "benchbot-task-maze"]
        assert search("numpy", [f"{url}/html"]) == []
        for address, said in ((f"{url}/none", "offers no list"), (f"{url}/gone", "404"), ("/folder", "no http")):
            with pytest.raises(BenchbotError) as caught:
                search("maze", [address])
            assert said in caught.value.why
            assert "secret" not in str(caught.value)
        server.shutdown()
