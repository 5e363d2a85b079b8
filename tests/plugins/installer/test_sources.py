import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.authoring.scaffold.render import create
from benchbot.plugins.installer import requirements, search, sources
from benchbot.plugins.installer.indexes import Indexes, public
from benchbot.plugins.installer.installer_errors import complaint
from benchbot.plugins.installer.plan import Action, action_of
from benchbot.plugins.installer.running import Done, Runner


@pytest.mark.parametrize(
    ("url", "split"),
    [
        ("https://example.org/me/x.git", ("https://example.org/me/x.git", "")),
        ("https://example.org/me/x@v1.0", ("https://example.org/me/x", "v1.0")),
        ("https://me:secret@example.org/me/x", ("https://me:secret@example.org/me/x", "")),
        ("https://me@example.org/me/x.git@feature/y", ("https://me@example.org/me/x.git", "feature/y")),
        ("git@example.org:me/x.git", ("git@example.org:me/x.git", "")),
        ("git@example.org:me/x.git@v1", ("git@example.org:me/x.git", "v1")),
        ("https://example.org/me/x@--upload-pack=touch", ("https://example.org/me/x@--upload-pack=touch", "")),
    ],
)
def test_what_is_wanted_of_a_repository(url: str, split: tuple[str, str]) -> None:
    assert sources._split(url) == split


@pytest.mark.parametrize(
    ("url", "name"),
    [
        ("https://example.org/me/x.git", ["me", "x"]),
        ("git@example.org:me/x", ["me", "x"]),
        ("file:///tmp/../..", ["file", "tmp"]),
        ("https://example.org/a b/$(touch)", ["a_b", "__touch_"]),
    ],
)
def test_the_name_of_an_addon_leads_nowhere_else(url: str, name: list[str]) -> None:
    assert sources._last_two(url) == name


def test_a_generated_project_builds_without_running_its_code_and_others_may_not(tmp_path: Path) -> None:
    project = create("task", "inert", tmp_path)
    settings = project / "pyproject.toml"
    text = settings.read_text()
    assert sources.builds_inertly(project)
    for changed in (
        text.replace("hatchling.build", "setuptools.build_meta"),
        text.replace('"hatchling>=1.26"', '"hatchling @ https://example.org/x.whl"'),
        text.replace("hatchling.build", "hatchling.build\nbackend-path = ['.']").replace('"\nbackend', '"\nbackend'),
        f"{text}\n[tool.hatch.build.hooks.custom]\n",
        f"{text}\n[tool.hatch.build.targets.wheel.hooks.custom]\npath = 'x.py'\n",
        f"{text}\n[tool.hatch.metadata.hooks.custom]\n",
        f"{text}\n[tool.hatch.version]\nsource = 'code'\npath = 'x.py'\n",
    ):
        settings.write_text(changed)
        assert not sources.builds_inertly(project)
    settings.write_text(text)
    (project / "hatch.toml").write_text("")
    assert not sources.builds_inertly(project)
    assert not sources.builds_inertly(tmp_path)


def test_secrets_are_left_out_of_what_is_said_and_of_the_options_of_processes() -> None:
    assert public("see https://me:secret@example.org/simple/ and http://token@x/") == (
        "see https://example.org/simple/ and http://x/"
    )
    indexes = Indexes("https://me:secret@example.org/simple", ("https://t@two/",), offline=True, links=(Path("w"),))
    assert indexes.words() == ["--no-index", "--find-links", str(Path("w").absolute())]
    assert indexes.variables("A", "B") == {"A": indexes.url, "B": "https://t@two/"}
    said = Runner().run([sys.executable, "-c", "print('https://me:secret@example.org/')"])
    assert said == Done(0, "https://example.org/\n", "")


def test_a_program_that_takes_too_long_is_ended_with_what_it_started() -> None:
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import time; time.sleep(600)'])"
    assert Runner().run([sys.executable, "-c", code], timeout_s=0.5) == Done(None, "", "")
    with pytest.raises(BenchbotError, match="no-such-program cannot be started"):
        Runner().run(["no-such-program"])


def test_files_of_requirements(tmp_path: Path) -> None:
    path = tmp_path / "r.txt"
    path.write_text("# all of it\nacme==1.0 \\\n    --hash=sha256:1 \\\n    --hash=sha256:2  # sure\n\n./folder\n")
    assert requirements.read(path) == ["acme==1.0 --hash=sha256:1 --hash=sha256:2", "./folder"]
    path.write_text("--index-url https://example.org\n")
    with pytest.raises(BenchbotError, match="holds an option"):
        requirements.read(path)
    with pytest.raises(BenchbotError, match="cannot be read"):
        requirements.read(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "action"),
    [
        (None, "1.0", Action.ADD),
        ("1.0", None, Action.REMOVE),
        ("1.0", "1.0", Action.REPLACE),
        ("1.9", "1.10", Action.UPGRADE),
        ("1.0rc1", "1.0", Action.UPGRADE),
        ("1.0", "1.0.1", Action.UPGRADE),
        ("1.0", "1.0.post1", Action.UPGRADE),
        ("2.0", "2.0.dev1", Action.DOWNGRADE),
        ("2.0", "1.9", Action.DOWNGRADE),
    ],
)
def test_what_leads_from_one_version_to_another(old: str | None, new: str | None, action: Action) -> None:
    assert action_of(old, new) is action


def test_what_an_installer_says_is_quoted_and_what_is_not_known_is_told_as_it_is() -> None:
    error = complaint("uv", Done(2, "", "Using Python\nerror: No space left on device (os error 28)\n"))
    assert (error.title, error.why) == ("The disk is full.", "uv says:\nNo space left on device (os error 28)")
    error = complaint("pip", Done(-9, "", ""))
    assert error.title == "pip failed."
    assert error.why == "pip ended with exit status -9. pip gave no reason."


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
        assert search.search("maze", [f"{url}/json/", f"{url}/html"]) == ["benchbot-mazes", "benchbot-task-maze"]
        assert search.search("numpy", [f"{url}/html"]) == []
        for address, said in ((f"{url}/none", "offers no list"), (f"{url}/gone", "404"), ("/folder", "no http")):
            with pytest.raises(BenchbotError) as caught:
                search.search("maze", [address])
            assert said in caught.value.why
            assert "secret" not in str(caught.value)
        server.shutdown()


def test_a_folder_of_nothing_is_told_with_what_it_might_be(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchbot", "plugins", "show", "benchbot-smple"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, "Did you mean 'benchbot-sample'?" in done.stderr) == (2, True)
