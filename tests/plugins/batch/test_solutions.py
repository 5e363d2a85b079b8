"""A batch runs the solution as it was when the batch began, whatever is done to its files meanwhile."""

import json
import os
import signal
from hashlib import sha256
from pathlib import Path

from tests.cli.solutions import PASSIVE
from tests.plugins.batch.conftest import TELLING, Batches, Solution, wait_until


def test_an_edit_changes_nothing_of_a_batch_that_runs_nor_of_one_that_goes_on(
    batches: Batches, solution: Solution
) -> None:
    words = ("--jobs", "2", "--args", "0.2")
    one = solution.write("one")
    assert batches.run("calm", *words, seeds="0..2").returncode == 0
    driver = batches.cli.start(*batches.words("b", *words, seeds="0..2"))
    wait_until(lambda: batches.told("b", "began"))
    two = solution.write("two")
    wait_until(lambda: batches.told("b", "finished"))
    driver.send_signal(signal.SIGINT)
    driver.communicate(timeout=120)

    refused = batches.run("b", *words, seeds="0..2")
    assert refused.returncode == 2
    assert refused.stderr.splitlines()[0].endswith(
        f"holds a batch of solution {one[:8]}, and what is given now is solution {two[:8]}."
    )
    assert "the file data.txt of the solution; the file helper.py of the solution; the file s.py" in refused.stderr
    assert "benchbot batch attach" in refused.stderr
    attached = batches.cli("batch", "attach", "b")
    assert attached.returncode == 0, attached.stderr
    said = f"solution {one[:8]}; its files have changed since (data.txt, helper.py, s.py), and it runs what they were"
    assert attached.stderr.splitlines()[0].endswith(said)
    solution.write("one")
    again = batches.run("b", *words, seeds="0..2")
    assert "6 done, 0 to do" in again.stderr

    assert solution.told("b") == {("content: one one one", one)}
    assert batches.results("b") == batches.results("calm")


def test_what_is_computed_once_more_is_computed_by_what_it_was_and_another_content_is_said(
    batches: Batches, solution: Solution
) -> None:
    one = solution.write("one")
    words = ("--jobs", "1", "--retries", "0")
    assert batches.run("b", *words, seeds="0", envs="faulty:crash,arena:1").returncode == 3
    two = solution.write("two")
    assert batches.cli("batch", "retry", "b").returncode == 3
    assert solution.told("b") == {("content: one one one", one)}

    updated = batches.run("b", *words, "--update", seeds="0", envs="arena:1")
    assert updated.returncode == 0, updated.stderr
    said = "results of other contents of the solution lie here as well, and count for nothing"
    assert updated.stderr.splitlines()[0].endswith(f"solution {two[:8]}; {said}: {one[:8]}")
    assert solution.told("b") == {("content: one one one", one), ("content: two two two", two)}
    (gathered,) = (batches.path("b") / "results").iterdir()
    assert two in gathered.read_text("utf-8")


def test_an_update_ends_the_workers_of_the_solution_before_and_is_refused_while_somebody_drives(
    batches: Batches, solution: Solution
) -> None:
    words = ("--jobs", "1", "--args", "0.5")
    one = solution.write("one")
    driver = batches.cli.start(*batches.words("b", *words, seeds="0..9", envs="arena:1"))
    wait_until(lambda: batches.told("b", "began"))
    two = solution.write("two")
    refused = batches.run("b", *words, "--update", seeds="0..9", envs="arena:1")
    assert refused.returncode == 2
    assert "Somebody drives the batch" in refused.stderr
    assert one in (batches.path("b") / "plan.json").read_text("utf-8")
    driver.send_signal(signal.SIGINT)
    driver.communicate(timeout=120)
    assert batches.cli("batch", "attach", "b", "--detach").returncode == 0
    wait_until(lambda: batches.told("b", "began") > 1)
    updated = batches.run("b", *words, "--update", seeds="0", envs="arena:1")
    assert updated.returncode == 0, updated.stderr
    assert not batches.processes("benchbot.plugins.batch.worker")
    assert [two in path.read_text("utf-8") for path in (batches.path("b") / "results").iterdir()] == [True]
    assert solution.told("b") <= {("content: one one one", one), ("content: two two two", two)}


def test_a_scratch_file_makes_no_other_batch_and_what_a_solution_writes_lies_beside_its_result(
    batches: Batches, solution: Solution
) -> None:
    writing = TELLING.replace("import helper", 'import helper\nopen("seen.txt", "a").write("x")')
    solution.batches.cli.script("s.py", writing)
    assert batches.run("b", "--jobs", "1", seeds="0", envs="arena:1").returncode == 0
    (solution.folder / "scratch.py").write_text("import helper")
    (solution.folder / "notes.md").write_text("to do")
    again = batches.run("b", "--jobs", "1", seeds="0", envs="arena:1")
    assert "1 done, 0 to do" in again.stderr
    assert "Not part of it, and not there when it runs: notes.md, passive.py, scratch.py." in again.stderr
    left = list((batches.path("b") / "episodes").rglob("work/*"))
    assert [path.name for path in left] == ["seen.txt"]
    assert left[0].read_text() == "x"
    assert not (solution.folder / "seen.txt").exists()
    assert not list((batches.path("b") / "solutions").rglob("*.pyc"))


def test_a_file_that_is_missed_is_named_with_the_option_that_adds_it(batches: Batches, solution: Solution) -> None:
    batches.cli.script("s.py", f"open('nib.sthgiew'[::-1])\n{PASSIVE}")
    (solution.folder / "weights.bin").touch()
    assert batches.run("b", "--jobs", "1", seeds="0", envs="arena:1").returncode == 1
    assert "If it is needed: --source weights.bin" in batches.cli("batch", "logs", "b", "arena").stdout
    assert batches.run("c", "--jobs", "1", "--source", "*.bin", seeds="0", envs="arena:1").returncode == 0


def test_a_snapshot_that_is_written_to_runs_no_more_until_it_is_mended(batches: Batches, solution: Solution) -> None:
    one = solution.write("one")
    driver = batches.cli.start(*batches.words("b", "--jobs", "1", "--args", "0.3", seeds="0..2", envs="arena:1"))
    wait_until(lambda: batches.told("b", "finished"))
    helper = batches.path("b") / "solutions" / one / "files" / "helper.py"
    helper.chmod(0o644)
    helper.write_text("CONTENT = 'forged'\n")
    _, said = driver.communicate(timeout=120)
    assert driver.returncode == 3
    assert "The snapshot of the solution is not what it was." in said
    assert "helper.py" in said

    mended = batches.run("b", "--jobs", "1", "--args", "0.3", seeds="0..2", envs="arena:1")
    assert mended.returncode == 0, mended.stderr
    assert "was damaged: it is set aside, and made anew" in mended.stderr
    assert solution.told("b") == {("content: one one one", one)}


def test_a_result_of_another_solution_is_not_counted_in_silence(batches: Batches, solution: Solution) -> None:
    one = solution.write("one")
    assert batches.run("b", "--jobs", "1", seeds="0", envs="arena:1").returncode == 0
    (path,) = (batches.path("b") / "episodes").glob("*/result.json")
    path.write_text(path.read_text().replace(one, "0" * 64))
    journal = path.with_name("attempts.jsonl")
    entries = [json.loads(line) for line in journal.read_text().splitlines()]
    entries[-1]["sha256"] = sha256(path.read_bytes()).hexdigest()
    journal.write_text("".join(json.dumps(entry) + "\n" for entry in entries))
    done = batches.run("b", "--jobs", "1", seeds="0", envs="arena:1")
    assert done.returncode == 3
    assert f"The batch holds results of another solution than {one[:8]}: 1." in done.stderr


def test_a_batch_of_an_edited_solution_in_a_folder_of_its_own_says_where_the_one_before_is(
    batches: Batches, solution: Solution
) -> None:
    words = [word for word in batches.words("b", "--jobs", "1", seeds="0", envs="arena:1") if word not in ("b", "-o")]
    words.remove("--output-location")
    one = batches.cli(*words)
    solution.write("two")
    two = batches.cli(*words)
    assert (one.returncode, two.returncode) == (0, 0), one.stderr + two.stderr
    assert "another content" not in one.stderr
    before = Path(one.stdout.strip()).name
    assert two.stderr.splitlines()[0].endswith(f"another content of the solution was computed in {before}")
    assert "1 done, 0 to do" in batches.cli(*words).stderr


def test_a_bundle_of_results_holds_the_solution_that_the_batch_has_run(batches: Batches, solution: Solution) -> None:
    assert batches.run("b", "--jobs", "1", seeds="0", envs="arena:1").returncode == 0
    assert batches.cli("bundle", "b/results", "--solution", ".", "--leave-out", "b", "-o", "same.zip").returncode == 0
    solution.write("two")
    refused = batches.cli("bundle", "b/results", "--solution", ".", "--leave-out", "b", "-o", "no.zip")
    assert refused.returncode == 2
    assert "data.txt is not as it was when the results were made." in refused.stderr
    assert "Leave --solution out" in refused.stderr

    made = batches.cli("bundle", "b/results", "-o", "made.zip")
    assert made.returncode == 0, made.stderr
    assert "The solution is the snapshot that the batch has run" in made.stderr
    again = batches.cli("reproduce", "made.zip", "--native", "--trust")
    assert (again.returncode, again.stdout) == (0, "identical  arena:1, seed 0\n"), again.stderr
    assert "content: one one one" in again.stderr


def test_modules_and_programs_run_from_the_snapshot_wherever_they_lie(batches: Batches, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    (elsewhere / "pkg").mkdir(parents=True)
    (elsewhere / "pkg" / "__init__.py").touch()
    (elsewhere / "pkg" / "__main__.py").write_text(f"import lib\nprint('ran', lib.__file__, flush=True)\n{PASSIVE}")
    (tmp_path / "lib.py").touch()
    script = batches.cli.folder / "go"
    script.write_text('#!/bin/sh\ncat data/note.txt\nexec "$1" -m pkg\n')
    script.chmod(0o755)
    (batches.cli.folder / "data").mkdir()
    (batches.cli.folder / "data" / "note.txt").write_text("noted\n")
    python = batches.solution.split()[0]
    paths = [str(elsewhere), str(tmp_path), batches.cli.variables["PYTHONPATH"]]
    batches.cli.variables["PYTHONPATH"] = os.pathsep.join(paths)
    for folder, solution in (("b", f"./go {python}"), ("c", f"{python} -m pkg")):
        batches.solution = solution
        done = batches.run(folder, "--jobs", "1", seeds="0", envs="arena:1")
        log = batches.cli("batch", "logs", folder, "arena").stdout
        assert done.returncode == 0, done.stderr + log
        assert f"ran {batches.path(folder)}/episodes/" in log
        assert ("noted" in log) == (folder == "b")
