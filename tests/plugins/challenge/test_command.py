"""Challenges as organisers and teams meet them: `benchbot challenge` in real processes, solutions in real sandboxes."""

import hashlib
import json
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import docker
import pytest
import yaml

from benchbot.plugins.challenge import signing
from benchbot.plugins.containers import context, engine, mode, transfer
from tests.cli.solutions import CRASHING, PASSIVE
from tests.cli.submitted import SELECTION
from tests.command_line import CommandLine, ended, wait_for
from tests.plugins.batch.test_batch import TRUTHS, truth
from tests.plugins.containers import solutions

BATCH = {
    "task": "sample:passive",
    "robots": ["sample_robot"],
    "environments": ["arena:1"],
    "evaluate_with": "omq",
    "timeout_s": 60,
    "record": ["frames"],
}


def declare(cli: CommandLine, change: Callable[[dict[str, Any]], None] = lambda _: None) -> None:
    """Make a challenge in `demo`, with the sample plug-in's places."""
    made = cli("challenge", "init", "demo")
    assert made.returncode == 0, made.stderr
    path = cli.folder / "demo" / "challenge.yaml"
    document = yaml.safe_load(path.read_text("utf-8"))
    document["phases"] = {"development": {"batch": dict(BATCH), "quota": {"per_day": 10}, "modes": ["sandbox"]}}
    change(document)
    path.write_text(yaml.safe_dump(document), "utf-8")


def served(cli: CommandLine, *words: str) -> tuple[Any, str]:
    """Start the server; return its process and address."""
    process = cli.start("challenge", "serve", "demo", "--port", "0", *words)
    line = wait_for(process, "is served at")
    return process, line.partition("served at ")[2].partition(". ")[0].strip()


def joined(cli: CommandLine, url: str, *words: str) -> None:
    (invitation,) = cli("challenge", "invite", "demo").stdout.split()
    answer = cli("challenge", "join", url, invitation, *words)
    assert answer.returncode == 0, answer.stderr


def solution(cli: CommandLine, name: str, code: str) -> str:
    (cli.folder / name).mkdir()
    (cli.folder / name / "solution.py").write_text(code)
    return name


def submit(cli: CommandLine, url: str, folder: str, *words: str, command: str = "python solution.py") -> Any:
    """Hand a folder in, and return what has become of it."""
    answer = cli("challenge", "submit", url, folder, "--command", command, "--wait", "--json", *words)
    assert answer.returncode == 0, answer.stderr
    return json.loads(answer.stdout)


def asked(url: str, path: str) -> Any:
    with urlopen(f"{url}{path}") as answer:
        return json.load(answer)


@pytest.fixture
def cli(cli: CommandLine, make_plugin: Callable[..., Path]) -> CommandLine:
    """A command line whose sample environment has a ground truth."""
    cli.variables["BENCHBOT_DATA_DIR"] = str(cli.home / "data")
    make_plugin("arena-truths", TRUTHS, {"ground_truths/1.json": truth(1)})
    return cli


def test_from_an_empty_folder_to_a_leaderboard_that_anybody_can_verify(cli: CommandLine) -> None:
    declare(cli, lambda document: document.update(teams={"signed": True}))
    process, url = served(cli)
    key_line = wait_for(process, "identifier of its key")
    (keyid,) = key_line.rpartition(": ")[2].split()
    assert cli("key", "make", "ada.key").returncode == 0
    joined(cli, url, "Ada", "--key", "ada.key")
    good, bad = solution(cli, "good", PASSIVE), solution(cli, "bad", CRASHING)

    scored = submit(cli, url, good, "--key", "ada.key", "--title", "first")
    assert scored["state"] == "scored"
    crashed = submit(cli, url, bad, "--key", "ada.key")
    assert (crashed["state"], crashed["score"]) == ("scored", 0.0)
    lacking = submit(cli, url, good, "--key", "ada.key", command="no_such_program")
    assert lacking["state"] == "failed"
    assert "no_such_program" in lacking["reason"]

    # From another machine, which has the token and the key alone.
    kept = next((cli.home / "data").rglob("challenges/*.json"))
    (cli.folder / "token").write_text(json.loads(kept.read_text())["token"])
    kept.unlink()
    again = cli(
        "challenge", "submit", url, good, "--command", "python solution.py", "--key", "ada.key", "--token-file", "token"
    )
    assert again.returncode == 0, again.stderr
    withdrawn = cli("challenge", "withdraw", url, again.stdout.strip(), "--token-file", "token")

    (row,) = asked(url, "/api/v1/phases/development/leaderboard")["standings"]
    assert row["team"] == "Ada"
    assert row["by_environment"].keys() == {"arena:1"}
    assert {(item["kind"], item["environment"]) for item in row["pictures"]} >= {("map", "arena:1")}
    for item in row["pictures"]:
        with urlopen(f"{url}/phases/development/pictures/{item['file']}") as answer:
            assert hashlib.sha256(answer.read()).hexdigest() == item["file"].partition(".")[0]
    assert withdrawn.returncode == 0 or "cannot be withdrawn" in withdrawn.stderr

    assert cli("challenge", "publish", "demo", "site").returncode == 0
    assert cli("challenge", "verify", "site", "--key", keyid).returncode == 0
    assert cli("challenge", "verify", "site", "--key", "0" * 64).returncode == 2

    # A team that keeps its solution to itself sees where it would stand.
    selection = ("--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1")
    words = (*selection, "--native", f"{sys.executable} good/solution.py")
    assert cli("submit", *words, "--results-location", "own.json").returncode == 0
    assert cli("eval", "own.json", "--method", "omq", "--output-location", "own_scores.json").returncode == 0
    stands = cli("challenge", "compare", "site", "own_scores.json", "--json")
    assert [(place["team"], place["score"]) for place in json.loads(stands.stdout)] == [
        ("Ada", row["score"]),
        ("(yours)", row["score"]),
    ]
    assert cli("challenge", "backup", "demo", "backup.zip").returncode == 0
    process.terminate()
    assert ended(process) == 0
    assert cli.no_process_is_left()
    assert cli("challenge", "restore", "backup.zip", "again").returncode == 0
    assert cli("challenge", "publish", "again", "site_again").returncode == 0
    assert cli("challenge", "verify", "site_again", "--key", keyid).returncode == 0


def test_a_hidden_phase_runs_with_a_secret_of_which_nothing_is_told(cli: CommandLine) -> None:
    def hide(document: dict[str, Any]) -> None:
        document["phases"]["development"] |= {"hidden": True, "told_every_s": 1}

    declare(cli, hide)
    process, url = served(cli)
    joined(cli, url, "Ada")
    scored = submit(cli, url, solution(cli, "good", PASSIVE))
    assert scored["state"] == "scored"
    assert cli("challenge", "publish", "demo", "site").returncode == 0
    assert "cannot be revealed yet" in cli("challenge", "publish", "demo", "early", "--reveal").stderr
    process.terminate()
    assert ended(process) == 0
    folder = cli.folder / "demo"
    secret = (folder / "runs.secret").read_text("ascii").strip()
    results = [path.read_text("utf-8") for path in (folder / "work").rglob("result*.json")]
    assert any(secret in text for text in results)  # it was run with it
    assert not (folder / "pictures").exists()
    told = [path.read_bytes() for path in (cli.folder / "site").rglob("*") if path.is_file()]
    told.append(json.dumps(scored).encode())
    assert scored["id"].encode() in b"".join(told[:-1])
    assert hashlib.sha256((folder / "runs.secret").read_bytes()).hexdigest().encode() in b"".join(told[:-1])
    for word in (secret.encode(), b"arena", str(cli.folder).encode()):
        assert not any(word in content for content in told)

    # It is over: the secrets are published, and anybody sees that they are those of the start.
    path = folder / "challenge.yaml"
    document = yaml.safe_load(path.read_text("utf-8"))
    document["phases"]["development"]["closes"] = "2026-01-01T00:00:00Z"
    path.write_text(yaml.safe_dump(document), "utf-8")
    assert cli("challenge", "publish", "demo", "over", "--reveal").returncode == 0
    told_now = cli("challenge", "verify", "over")
    assert "runs.secret is what was committed to." in told_now.stdout
    assert (cli.folder / "over" / "runs.secret").read_text("ascii").strip() == secret
    (cli.folder / "over" / "runs.secret").write_text("0" * 64)
    refused = cli("challenge", "verify", "over")
    assert (refused.returncode, "runs.secret is not what was committed to" in refused.stderr) == (2, True)


def test_a_phase_that_cannot_be_computed_is_refused_before_anybody_hands_in(cli: CommandLine) -> None:
    def misspell(document: dict[str, Any]) -> None:
        document["phases"]["development"]["batch"]["environments"] = ["arean:1"]

    declare(cli, misspell)
    refused = cli("challenge", "serve", "demo", "--port", "0")
    assert refused.returncode == 2
    assert "Phase 'development'" in refused.stderr
    assert "arean" in refused.stderr
    assert "challenge.yaml" in refused.stderr


def test_only_modes_that_this_machine_can_run_are_admitted(cli: CommandLine) -> None:
    cli.variables["DOCKER_HOST"] = "unix:///nonexistent.sock"
    declare(cli, lambda document: document["phases"]["development"].pop("modes"))
    process = cli.start("challenge", "serve", "demo", "--port", "0")
    assert "The container engine does not answer" in wait_for(process, "admits no solution in a container")
    url = wait_for(process, "is served at").partition("served at ")[2].partition(". ")[0].strip()
    assert asked(url, "/api/v1/challenge")["phases"]["development"]["modes"] == ["sandbox"]
    process.terminate()
    assert ended(process) == 0
    path = cli.folder / "demo" / "challenge.yaml"
    document = yaml.safe_load(path.read_text("utf-8"))
    document["phases"]["development"]["modes"] = ["container"]
    path.write_text(yaml.safe_dump(document), "utf-8")
    refused = cli("challenge", "serve", "demo", "--port", "0")
    assert (refused.returncode, "The container engine does not answer" in refused.stderr) == (2, True)


@pytest.mark.xdist_group("containers")
def test_a_container_goes_the_whole_way_as_a_folder_a_bundle_and_an_image(
    cli: CommandLine, podman: dict[str, str]
) -> None:
    """Built, or loaded; run without network, scored, within the quota, verified; and no image stays that was loaded."""
    cli.variables |= podman

    def admit(document: dict[str, Any]) -> None:
        document["phases"]["development"] |= {"modes": ["container"], "quota": {"per_day": 4}}

    declare(cli, admit)
    process, url = served(cli)
    assert cli("key", "make", "ada.key").returncode == 0
    joined(cli, url, "Ada", "--key", "ada.key")
    solutions.write(cli.folder / "solution", PASSIVE)
    words = ("--containerised", "solution", "--weak-limits", *SELECTION, "-r", "result.json")
    assert cli("submit", *words).returncode == 0
    bundled = cli("bundle", "result.json", "--solution", "solution")
    assert bundled.returncode == 0, bundled.stderr

    with engine.reached() as reached, mode.container_mode(context.find(_hostile(cli)), print) as hostile:
        image = hostile.image
        with closing(reached.connect()) as client:
            digest = client.inspect_image(image)["Id"]  # type: ignore[no-untyped-call]

    signed = ("--key", "ada.key")
    sandboxed = cli("challenge", "submit", url, "solution", "--command", "python solution.py", *signed)
    assert "A solution in a sandbox is not admitted" in sandboxed.stderr
    absent = cli("challenge", "submit", url, "localhost/some/image", *signed)
    assert "podman pull localhost/some/image" in absent.stderr
    for what in ("solution", "bundle.zip", image):
        answer = cli("challenge", "submit", url, what, "--title", what, "--wait", "--json", *signed)
        assert answer.returncode == 0, answer.stderr
        made = json.loads(answer.stdout)
        assert (made["mode"], made["state"]) == ("container", "scored"), made
        assert made["image"] == (digest if what == image else None)
    (cli.folder / "broken").mkdir()
    (cli.folder / "broken" / "Dockerfile").write_text("FROM scratch\nCOPY no_such_file /\n")
    broken = json.loads(cli("challenge", "submit", url, "broken", "--wait", "--json", *signed).stdout)
    assert (broken["state"], "no_such_file" in broken["reason"]) == ("failed", True), broken
    over = cli("challenge", "submit", url, "solution", *signed)
    assert "has used up its submissions" in over.stderr
    said = [path.read_text("utf-8", "replace") for path in (cli.folder / "demo" / "work" / made["id"]).rglob("log.txt")]
    assert "was refused: ['/outside', '/solution', '/usr/bin/python', 'socket']" in "".join(said)

    (row,) = asked(url, "/api/v1/phases/development/leaderboard")["standings"]
    assert (row["title"], row["entries"]) == ("solution", 3)  # of equal scores the earlier
    assert row["pictures"]
    assert cli("challenge", "publish", "demo", "site").returncode == 0
    assert cli("challenge", "verify", "site").returncode == 0
    process.terminate()
    assert ended(process) == 0
    found = [
        json.loads(path.read_bytes()) for path in (cli.folder / "demo/work").glob("*/batch/episodes/*/result.json")
    ]
    assert [result["provenance"]["solution"]["mode"] for result in found] == ["container"] * 3
    loaded = transfer.name_of(digest.removeprefix("sha256:"))
    assert loaded in [result["provenance"]["solution"]["command"][0] for result in found]
    rows = json.loads((cli.folder / "site" / "development-rows.json").read_bytes())
    assert [signing.image_in(row["score_envelope"]) for row in rows] == [None, None, digest]
    with closing(docker.APIClient(base_url=podman["DOCKER_HOST"])) as client:
        assert client.containers(all=True) == []
        with pytest.raises(docker.errors.ImageNotFound):
            client.inspect_image(loaded)  # type: ignore[no-untyped-call]


TRIES_THE_OUTSIDE = """\
import os, socket
refused = []
for path in ("/outside", "/solution", "/usr/bin/python"):
    try:
        open(path + "/x" if os.path.isdir(path) else path, "w")
    except OSError:
        refused.append(path)
try:
    socket.create_connection(("127.0.0.1", 8090), 1)
except OSError:
    refused.append("socket")
print("was refused:", refused, flush=True)
"""


def _hostile(cli: CommandLine) -> Path:
    """A solution whose own entry point tries to write outside and to reach a network, and then does as it should."""
    started_by = 'ENTRYPOINT ["python", "-u", "/solution/solution.py"]'
    dockerfile = solutions.DOCKERFILE.replace('CMD ["python", "/solution/solution.py"]', started_by)
    assert started_by in dockerfile
    return solutions.write(cli.folder / "hostile", f"{TRIES_THE_OUTSIDE}{PASSIVE}", dockerfile)
