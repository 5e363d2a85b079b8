"""`benchbot-stop` and `benchbot stop`: the end of runs, and the emergency stop of their robots, at once.

It starts in a few milliseconds, since it imports the standard library alone. It finds runs by their state files
(benchbot.wire.run_state), and asks their supervisors to stop (docs/wire.md, POST /api/v1/stop).
"""

import fcntl
import json
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

ANSWER_TIMEOUT_S = 2.0
OWNERS = ("benchbot run", "benchbot submit")
"""The owners of runs that are ended without being named; what something else has started goes on."""
USAGE = """\
Usage: benchbot-stop [--all | --run ID]

  End the newest run or submission, in the middle of an action too: the emergency stop. As benchbot stop does.

  --all     End every back end of this user, also those of batches, which then start others.
  --run ID  End this one: a part of its name that no other has, or its robot."""


class CannotStopError(Exception):
    """What cannot be stopped: what went wrong, why, and the exact fix."""

    def __init__(self, title: str, why: str, fix: str) -> None:
        super().__init__(title)
        self.title, self.why, self.fix = title, why, fix


def main() -> int:
    """Run the program `benchbot-stop`; return its exit code."""
    words = sys.argv[1:]
    if words[:1] in (["-h"], ["--help"]):
        print(USAGE)
        return 0
    if not understands(words):
        print(USAGE, file=sys.stderr)
        return 2
    return stop_as_told(words, "benchbot-stop")


def understands(words: Sequence[str]) -> bool:
    """Return whether these are the words of a plain call, with one option at most."""
    return list(words) in ([], ["--all"]) or (len(words) == 2 and words[0] == "--run")


def stop_as_told(words: Sequence[str], by: str) -> int:
    """Stop what the words of a plain call say, tell of it on stderr, and return the exit code."""
    try:
        for line in stop(every="--all" in words, run=words[1] if len(words) == 2 else None, by=by):
            print(_printable(line), file=sys.stderr)
    except CannotStopError as error:
        told = map(_printable, (error.title, error.why, error.fix))
        print("Error: {}\n\n  {}\n\n  Fix: {}".format(*told), file=sys.stderr)
        return 2
    return 0


def stop(*, every: bool, run: str | None, by: str) -> list[str]:
    """Stop the newest run of somebody's, all runs, or the one with `run` in its name; return what was done, in lines.

    `by` is told to the run: its result says who has stopped it. Raises CannotStopError when there is nothing to stop,
    or one could not be stopped.
    """
    alive, there = _alive(), _given()
    if run is not None:
        found = called(run, [(_name(state), state["robot"]) for state in alive])
        if isinstance(found, tuple):
            raise CannotStopError(*found)
        ending = [alive[found]]
    elif every:
        ending = alive
    elif there is not None:
        ending = [state for state in alive if state["connection"] == there]
    else:
        ending = [state for state in alive if state["owner"] in OWNERS][:1]
    if not ending and (there is None or every):
        raise _nothing(alive)
    ends: list[Callable[[], str]] = [lambda state=state: _end(state, by) for state in ending]  # type: ignore[misc]
    if not ending and there is not None:
        ends = [lambda: _end_there(there, by)]
    lines, failures = _all_at_once(ends)
    left = [state for state in alive if state not in ending]
    others = dict.fromkeys(_about(state) if state["owner"] in OWNERS else state["owner"] for state in left)
    lines += [f"It goes on: {line}" for line in others]
    if failures:
        raise CannotStopError(failures[0].title, "\n".join([failures[0].why, *lines]), failures[0].fix)
    return lines


def called(name: str, runs: Sequence[tuple[str, str]]) -> int | tuple[str, str, str]:
    """Return which run, of names and robots, has `name` in its name or as its robot.

    Unless it is exactly one: what is wrong, why, and the fix.
    """
    found = [number for number, (run, robot) in enumerate(runs) if name in run or name == robot]
    if len(found) == 1:
        return found[0]
    return (
        f"{'Several runs are' if found else 'No run is'} called '{name}'.",
        f"Alive are: {', '.join(run for run, _ in runs) or 'none'}.",
        "Give the name of one of them, a part that no other has, or its robot if that has one run only.",
    )


def is_locked(path: str | os.PathLike[str]) -> bool:
    """Say whether a process that is alive holds the lock of a file or folder; False where there is none."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(handle)
    return False


def runs_dir() -> Path:
    """Return the folder of this user's runs, as benchbot.wire.run_state has it."""
    state_dir = os.environ.get("BENCHBOT_STATE_DIR")
    if not state_dir:
        base = os.environ.get("XDG_STATE_HOME", "").strip() or "~/.local/state"
        state_dir = f"{base}/benchbot"
    return Path(state_dir).expanduser().absolute() / "runs"


def _alive() -> list[dict[str, Any]]:
    """Return the state documents of this user's runs that are alive, newest first."""
    states = []
    with suppress(FileNotFoundError):
        for entry in os.scandir(runs_dir()):
            # A document that vanishes, or is half there, is that of a run that is just ending.
            with suppress(OSError, ValueError, KeyError):
                if entry.stat(follow_symlinks=False).st_uid == os.geteuid() and is_locked(entry.path):
                    document = Path(entry.path, "run.json").read_text("utf-8")
                    states.append({"owner": OWNERS[0], **json.loads(document)})
    return sorted(states, key=lambda state: state["started_s"], reverse=True)


def _given() -> dict[str, str | None] | None:
    """Return the connection that the environment names, as a state document has it; None when it names none."""
    url, path = os.environ.get("BENCHBOT_URL") or None, os.environ.get("BENCHBOT_SOCKET") or None
    return {"url": url, "socket": path, "token": os.environ.get("BENCHBOT_TOKEN", "")} if url or path else None


def _nothing(alive: Sequence[Mapping[str, Any]]) -> CannotStopError:
    title = "No run of yours is there to stop."
    if not alive:
        return CannotStopError(title, "No back end of this user is alive.", "See what is there: benchbot tui")
    return CannotStopError(
        title,
        f"What is alive belongs to something else: {'; '.join(map(_about, alive))}.",
        f"End that (of a batch: benchbot batch cancel FOLDER), one of them (benchbot stop --run {_name(alive[0])}), "
        "or all at once: benchbot stop --all",
    )


def _all_at_once(ends: Sequence[Callable[[], str]]) -> tuple[list[str], list[CannotStopError]]:
    """Return what was done, and what could not be; none waits for another one that hangs."""
    lines: list[str] = []
    failures: list[CannotStopError] = []

    def do(end: Callable[[], str]) -> None:
        try:
            lines.append(end())
        except CannotStopError as error:
            failures.append(error)

    threads = [threading.Thread(target=do, args=(end,)) for end in ends]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return lines, failures


def _end(state: Mapping[str, Any], by: str) -> str:
    """End a run, by force when it does not answer; return what was done."""
    what, began_s = f"The run {_about(state)},", time.monotonic()
    try:
        # With the solution's token it would be the solution that stops.
        _ask_to_stop({**state["connection"], "token": state["operator_token"]}, by)
    except OSError:
        # Only one that is still alive, as its lock says: by now its number may be another process's.
        while any(each["operator_token"] == state["operator_token"] for each in _alive()):
            if time.monotonic() - began_s >= ANSWER_TIMEOUT_S:
                # The platform's process ends with the supervisor, however that one ends.
                os.kill(state["pid"], signal.SIGKILL)
                return f"{what} did not answer, and was killed."
            time.sleep(0.05)  # one that is ending answers no more
        return f"{what} has ended."
    return f"{what} is ending."


def _end_there(connection: Mapping[str, Any], by: str) -> str:
    where = connection["url"] or connection["socket"]
    try:
        _ask_to_stop(connection, by)
    except OSError as error:
        raise CannotStopError(
            f"The back end at {where} does not answer.",
            f"{error.strerror or error}.",
            "Correct BENCHBOT_URL or BENCHBOT_SOCKET, or unset them: the newest run of yours is then stopped.",
        ) from error
    return f"The back end at {where} is ending."


def _ask_to_stop(connection: Mapping[str, Any], by: str) -> None:
    """Send the order to stop; raises OSError when nobody takes it, CannotStopError for one that is refused."""
    body = json.dumps({"by": by})
    request = (
        "POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Type: application/json\r\n"
        f"Authorization: Bearer {connection['token']}\r\nContent-Length: {len(body)}\r\n\r\n{body}"
    )
    with _connected(connection) as there:
        there.sendall(request.encode())
        answer = b""
        while chunk := there.recv(65536):
            answer += chunk
    head, _, content = answer.partition(b"\r\n\r\n")
    status = head.split(b" ", 2)[1:2]
    if status == [b"200"]:
        return
    if not status:
        raise ConnectionResetError("it hung up")
    try:
        told = json.loads(content)
        raise CannotStopError(told["title"], told["why"], told["fix"])
    except (ValueError, KeyError, TypeError):
        fix = "Compare its version with yours."
        raise CannotStopError("The run cannot be stopped.", f"It answered {status[0].decode()}.", fix) from None


def _connected(connection: Mapping[str, Any]) -> socket.socket:
    if connection["url"]:
        address = connection["url"].partition("://")[2].split("/")[0]
        host, _, port = address.rpartition(":") if ":" in address.rpartition("]")[2] else (address, "", "80")
        return socket.create_connection((host.strip("[]"), int(port)), ANSWER_TIMEOUT_S)
    there = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    there.settimeout(ANSWER_TIMEOUT_S)
    try:
        there.connect(connection["socket"])
    except OSError:
        there.close()
        raise
    return there


def _name(state: Mapping[str, Any]) -> str:
    return Path(state["folder"]).name


def _about(state: Mapping[str, Any]) -> str:
    """Return the run in words, as benchbot.wire.run_state has them."""
    what = f"{_name(state)} of {state['owner']}: {state['task']} on {state['robot']} in {state['environment']}"
    since = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(state["started_s"]))
    address = state["connection"]["url"] or state["connection"]["socket"]
    return f"{what}, {address}, process {state['pid']}, since {since}"


def _printable(text: str) -> str:
    """Return a line without what could command the terminal: a run's names come from declarations."""
    return "".join(char if char.isprintable() else " " for char in text)


if __name__ == "__main__":
    sys.exit(main())
