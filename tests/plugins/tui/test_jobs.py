import os
import signal
import time
from pathlib import Path

from benchbot.plugins.tui import jobs
from benchbot.wire import run_state

PATIENCE_S = 120.0
SELECTION = ["--task=sample:passive", "--robot=sample_robot", "--env=arena:1"]


def ended(job: jobs.Job) -> jobs.Job:
    deadline_s = time.monotonic() + PATIENCE_S
    while job.alive:
        assert time.monotonic() < deadline_s, jobs.log_of(job)
        time.sleep(0.05)
    return job


def test_what_is_started_goes_on_by_itself_and_says_what_came_of_it(home: Path) -> None:
    result = home / "work" / "result.json"
    well = ["submit", "--example=hello_passive", f"--results-location={result}", "--evaluate-with=omq", "--json"]
    run = jobs.start(["run", *SELECTION, "--port=0"])
    submission = jobs.start([*well, *SELECTION], result=result)
    impossible = jobs.start(
        ["submit", "--example=hello_passive", "--task=sample:passive", "--robot=nobody", "--env=arena:1"]
    )

    state = jobs.wait_for_run(run, PATIENCE_S, 0.05)

    assert state is not None
    assert state.pid == run.pid
    assert os.getsid(run.pid) == run.pid, "a terminal that closes ends only its own session"
    for job in (submission, impossible):
        ended(job)
    assert jobs.wait_for_run(impossible, PATIENCE_S, 0.05) is None
    now = jobs.look()
    assert [each.folder for each in now.runs] == [state.folder]
    said = {each.job.folder: (each.state, each.summary) for each in now.jobs}
    assert said == {
        submission.folder: (jobs.WELL, "OMQ 0.0000"),
        impossible.folder: (jobs.BADLY, "'nobody' is not a known robot."),
    }
    assert jobs.outcome_of(submission)["result_path"] == str(result)
    jobs.end(run)
    ended(run)
    assert run_state.live() == []
    assert "The back end has ended." in jobs.log_of(run)


def test_any_command_is_a_job_which_tells_what_it_printed_and_how_it_ended(home: Path) -> None:
    listing = jobs.start(["list", "robots"])
    failing = jobs.start(["show", "robot", "nobody", "--token=abc"])
    killed = jobs.start(["tui", "--display=plain", "--batch=nowhere"])
    jobs.end(killed)
    for job in (listing, failing, killed):
        ended(job)

    said = {each.job.folder: (each.state, each.summary) for each in jobs.look().jobs}

    assert said[listing.folder] == (jobs.WELL, "ended well")
    assert "sample_robot" in jobs.output_of(listing)
    assert said[failing.folder][0] == said[killed.folder][0] == jobs.BADLY
    assert (listing.title, failing.title) == ("list robots", "show robot nobody")
    assert failing.command == "benchbot show robot nobody '--token=…'"

    # As after an app that was closed before the end.
    (listing.folder / "code.txt").unlink()
    assert jobs.status_of(listing).summary == "ended; its log tells whether well"


def test_a_job_that_was_killed_is_told_as_such_and_old_ones_go(home: Path) -> None:
    killed = jobs.start(["submit", "--native=sleep 1000", *SELECTION])
    os.kill(killed.pid, signal.SIGKILL)
    ended(killed)

    assert [each.state for each in jobs.look().jobs] == [jobs.BADLY]
    assert jobs.last_error("") == "it was ended"
    assert jobs.last_error("Task  x\nError: It failed.\n\n  Why it did.") == "It failed."

    for number in range(jobs.KEPT_JOBS + 3):
        folder = killed.folder.with_name(f"20000101-{number:06}-old")
        folder.mkdir()
        text = (killed.folder / "job.json").read_text().replace(str(killed.folder), str(folder))
        (folder / "job.json").write_text(text)
    (killed.folder.with_name("20000101-half")).mkdir()
    kept = jobs.jobs()

    assert len(kept) == jobs.KEPT_JOBS
    assert kept[0] == killed
