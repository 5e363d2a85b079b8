"""Bundles as a whole: made of results and a solution, and read with suspicion."""

import json
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from markdown_it import MarkdownIt

from benchbot.core.errors import BenchbotError
from benchbot.evaluation.result_document import ResultDocument
from benchbot.plugins.bundles import archive, bundle_file, solution_source
from benchbot.plugins.bundles.archive import Member
from benchbot.plugins.challenge import intake
from benchbot.plugins.challenge.document import Challenge, Phase
from tests.command_line import Here
from tests.plugins.bundles.conftest import SOLUTION
from tests.plugins.containers import layouts
from tests.plugins.containers.test_layout import FILES


def made(target: Path, results: list[ResultDocument], solution: Path, **options: Any) -> dict[str, Any]:
    return bundle_file.make(target, results, solution_source.collect(solution), **options)


def with_solution(result: ResultDocument, **solution: Any) -> ResultDocument:
    document = json.loads(json.dumps(result.document))
    document["provenance"]["solution"].update(solution)
    return ResultDocument(result.source, document)


def test_a_bundle_holds_all_that_is_needed_and_reads_back(
    tmp_path: Path, handed_in: ResultDocument, solution: Path
) -> None:
    path = tmp_path / "bundle.zip"
    manifest = made(path, [handed_in], solution, timeout_s=60)

    with bundle_file.opened(path) as bundle:
        assert bundle.manifest == json.loads(json.dumps(manifest))
        assert [result.document for result in bundle.results] == [handed_in.document]
        bundle.extract_solution(tmp_path / "unpacked")
        readme = bundle.archive.members["README.md"].read().decode()
    assert (tmp_path / "unpacked" / "solution.py").read_text() == SOLUTION
    assert manifest["solution"] == {"command": ["python", "solution.py"], "mode": "native", "timeout_s": 60}
    assert manifest["software"]["plugins"].keys() >= {"benchbot", "benchbot-sample"}
    assert manifest["results"][0]["file"] == "results/0001-arena-1-seed-3.json"
    assert "benchbot reproduce" in readme
    assert "arena:1 | 3 | - | well" in readme


def test_the_same_gives_the_same_bytes_under_any_name(
    tmp_path: Path, handed_in: ResultDocument, solution: Path
) -> None:
    for name in ("one.zip", "two.zip"):
        made(tmp_path / name, [handed_in], solution)
    assert (tmp_path / "one.zip").read_bytes() == (tmp_path / "two.zip").read_bytes()


def test_an_image_in_a_bundle_is_checked_and_counts_by_its_digest(
    tmp_path: Path, handed_in: ResultDocument, solution: Path
) -> None:
    ran = with_solution(handed_in, mode="container", command=["localhost/benchbot/image:1"])
    phase = Phase("test", "Test", {"evaluate_with": "omq"})
    challenge = Challenge(tmp_path, "rooms", "Rooms", {"test": phase})
    with pytest.raises(BenchbotError, match="There is no Dockerfile"):
        made(tmp_path / "none.zip", [ran], solution)
    for name, layers in (("sound", FILES), ("hostile", [layouts.layer(("../x", b""))])):
        files = layouts.make(layers)
        made(tmp_path / f"{name}.zip", [ran], layouts.write(tmp_path / name, files))
        digest = layouts.manifest_of(files)["config"]["digest"]
        assert intake.examined(tmp_path / f"{name}.zip") == intake.Solution((), "container", digest)
    assert intake.check(tmp_path / "sound.zip", challenge, phase).mode == "container"
    with pytest.raises(BenchbotError, match="The image is not sound"):
        intake.check(tmp_path / "hostile.zip", challenge, phase)


def test_a_command_is_made_portable(tmp_path: Path, handed_in: ResultDocument, solution: Path) -> None:
    script = str(solution / "solution.py")
    ran = with_solution(
        handed_in,
        command=["/opt/anywhere/bin/python3.12", script, "--fast", "1"],
        files={script: sha256(SOLUTION.encode()).hexdigest()},
    )
    manifest = made(tmp_path / "bundle.zip", [ran], solution)
    assert manifest["solution"]["command"] == ["python", "solution.py", "--fast", "1"]


@pytest.mark.parametrize(
    ("ran", "message"),
    [
        ({"files": {"solution.py": "0" * 64}}, "solution.py is not as it was when the result was made"),
        ({"files": {"other/x.py": "0" * 64}}, "which is not in"),
        ({"command": ["python", "/etc/passwd"]}, "The solution's command names /etc/passwd"),
        ({"command": []}, "does not say which command made it"),
    ],
)
def test_another_solution_than_the_results_is_refused(
    tmp_path: Path, handed_in: ResultDocument, solution: Path, ran: dict[str, Any], message: str
) -> None:
    with pytest.raises(BenchbotError) as caught:
        made(tmp_path / "bundle.zip", [with_solution(handed_in, **ran)], solution)
    assert message in caught.value.title
    assert not (tmp_path / "bundle.zip").exists()


def test_of_a_container_the_dockerfile_goes_in_and_what_the_image_was_given(
    tmp_path: Path, handed_in: ResultDocument, solution: Path
) -> None:
    ran = with_solution(handed_in, command=["benchbot/solution:0123", "--fast"], mode="container")
    with pytest.raises(BenchbotError, match="There is no Dockerfile"):
        made(tmp_path / "bundle.zip", [ran], solution)
    (solution / "Dockerfile").write_text("FROM scratch\n")

    manifest = made(tmp_path / "bundle.zip", [ran], solution)

    assert manifest["solution"] == {"command": ["--fast"], "mode": "container", "timeout_s": None}
    with bundle_file.opened(tmp_path / "bundle.zip") as bundle:
        assert b"in a container of its Dockerfile, which was given --fast" in bundle.archive.members["README.md"].read()


def test_a_lock_goes_in_when_it_is_of_the_same_versions(
    tmp_path: Path, handed_in: ResultDocument, solution: Path
) -> None:
    lock = tmp_path / "benchbot.lock"
    row = '[[distribution]]\nname = "benchbot-sample"\nversion = "{}"\nplugin = true\nfrom = "https://example.org/x"\n'
    lock.write_text(f"version = 1\n{row.format('1.0')}hashes = []\n")
    manifest = made(tmp_path / "bundle.zip", [handed_in], solution, lock=lock)
    assert manifest["lock"] in manifest["files"]

    lock.write_text(f"version = 1\n{row.format('0.9')}hashes = []\n")
    with pytest.raises(BenchbotError, match="not what the results ran on") as caught:
        made(tmp_path / "bundle.zip", [handed_in], solution, lock=lock)
    assert "locks benchbot-sample 0.9, and the results are of 1.0" in caught.value.why


def test_results_that_do_not_belong_together_are_refused(
    tmp_path: Path, handed_in: ResultDocument, solution: Path
) -> None:
    other = with_solution(handed_in, command=["python", "other.py"])
    with pytest.raises(BenchbotError, match="of different solutions"):
        made(tmp_path / "bundle.zip", [handed_in, other], solution)
    newer = with_solution(handed_in)
    newer.document["provenance"]["plugins"]["benchbot"]["version"] = "9"
    with pytest.raises(BenchbotError, match="same software"):
        made(tmp_path / "bundle.zip", [handed_in, newer], solution)
    del newer.document["provenance"]
    with pytest.raises(BenchbotError, match="does not say what made it"):
        made(tmp_path / "bundle.zip", [newer], solution)


def lies(manifest: dict[str, Any], files: dict[str, bytes]) -> None:
    files["solution/solution.py"] = b"print('Another one')\n"


def hides(manifest: dict[str, Any], files: dict[str, bytes]) -> None:
    files["solution/hidden.py"] = b""


def loses(manifest: dict[str, Any], files: dict[str, bytes]) -> None:
    del files["README.md"]


def swaps(manifest: dict[str, Any], files: dict[str, bytes]) -> None:
    manifest["results"][0]["observation_digest"] = "0" * 64


def is_newer(manifest: dict[str, Any], files: dict[str, bytes]) -> None:
    manifest["version"] = 2


def says_more(manifest: dict[str, Any], files: dict[str, bytes]) -> None:
    manifest["solution"]["run_as_root"] = True


def names_what_is_not_there(manifest: dict[str, Any], files: dict[str, bytes]) -> None:
    manifest["results"][0]["file"] = "results/../../x.json"


def has_a_result_that_is_none(manifest: dict[str, Any], files: dict[str, bytes]) -> None:
    path = manifest["results"][0]["file"]
    files[path] = b"[" * 100_000
    manifest["files"][path] = {"sha256": sha256(files[path]).hexdigest(), "bytes": len(files[path])}


@pytest.mark.parametrize(
    "change", [lies, hides, loses, swaps, is_newer, says_more, names_what_is_not_there, has_a_result_that_is_none]
)
def test_a_bundle_that_contradicts_itself_is_refused(
    tmp_path: Path,
    handed_in: ResultDocument,
    solution: Path,
    change: Callable[[dict[str, Any], dict[str, bytes]], None],
) -> None:
    path = tmp_path / "bundle.zip"
    manifest = made(path, [handed_in], solution)
    with archive.opened(path) as opened:
        files = {name: member.read() for name, member in opened.members.items()}
    change(manifest, files)
    files["manifest.json"] = json.dumps(manifest).encode()
    archive.write(path, [Member(name, content) for name, content in files.items()])

    with pytest.raises(BenchbotError), bundle_file.opened(path):
        pass


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"version": 1}', b"\xff", b"[" * 100_000])
def test_any_manifest_that_is_none_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bundle.zip"
    archive.write(path, [Member("manifest.json", content)])
    with pytest.raises(BenchbotError), bundle_file.opened(path):
        pass
    archive.write(path, [Member("other.json", content)])
    with pytest.raises(BenchbotError, match="not a sound bundle"), bundle_file.opened(path):
        pass


HOSTILE = "--x=`a` ``b`` | <script> ![x](https://evil.example/x.png)\n# c\x1b]52;c;cm0=\x07\x9b2J\u202e\nResult: 1.0"


def test_a_bundle_of_a_stranger_says_what_it_says_in_its_line(
    tmp_path: Path, driven: dict[str, Any], solution: Path, here: Here
) -> None:
    selection = {**driven["provenance"]["selection"], "settings": {"lighting.time": HOSTILE}}
    document = {**driven, "provenance": {**driven["provenance"], "selection": selection}}
    path = tmp_path / "bundle.zip"
    made(
        path,
        [ResultDocument("r.json", json.loads(json.dumps(document)))],
        solution,
        command=["python", "solution.py", HOSTILE],
    )

    with bundle_file.opened(path) as bundle:
        readme = bundle.archive.members["README.md"].read().decode()
    told = [
        here("reproduce", str(path), *words) for words in (["--check-only"], ["--unpack", str(tmp_path / "new")], [])
    ]

    kinds = {child.type for token in MarkdownIt().parse(readme) for child in (token, *(token.children or ()))}
    assert kinds.isdisjoint({"html_inline", "html_block", "image", "link_open"})
    assert readme.count("\n# ") == 0
    assert len({row.replace("\\|", "").count("|") for row in readme.splitlines() if row.startswith("| ")}) == 1
    for shown in (readme, *(done.stdout + done.stderr for done in told)):
        assert not {"\x1b", "\x07", "\x9b", "\u202e"} & set(shown)
    assert [line for done in told for line in done.stderr.splitlines() if line.startswith("Result: 1.0")] == []
    assert "Result: 1.0" in told[1].stdout
