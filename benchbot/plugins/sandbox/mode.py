"""The sandbox as a way to run a solution: bubblewrap, or Landlock where there is none, or not at all."""

import base64
import os
import secrets
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.plugin_manager import load
from benchbot.plugins.sandbox import bubblewrap, fallback
from benchbot.plugins.sandbox.control_group import ControlGroup, control_group
from benchbot.plugins.sandbox.hidden import hidden_paths
from benchbot.plugins.sandbox.result_pipe import ResultPipe, result_pipe
from benchbot.plugins.sandbox.syscalls import filter_program
from benchbot.plugins.sandbox.view import View, view_of
from benchbot.submission import limits
from benchbot.submission.modes import RESULT, RESULT_MAX_BYTES, ProcessLimits, Running, unix_socket_of
from benchbot.submission.solution import CODE, Leading, Solution
from benchbot.wire.run_state import Connection

if TYPE_CHECKING:
    from benchbot.submission.modes import SolutionSpec

PASSED_ON = ("LANG", "LANGUAGE", "TZ", "PYTHONHASHSEED", "PYTHONUTF8")
PASSED_ON_ENDS = ("_NUM_THREADS",)
PASSED_ON_STARTS = ("LC_",)
SPARE_USERS = range(2_000_000_000, 2_100_000_000)
NOBODY = 65534


@dataclass(frozen=True)
class Sandbox:
    """Runs a solution that sees the system, its folder, what is `readable`, and nothing else; see `hidden_paths`."""

    readable: tuple[Path, ...] = ()
    needs_socket = True

    @property
    def name(self) -> str:
        """`sandbox`, or `sandbox-landlock` for the weaker one."""
        return "sandbox" if bubblewrap_problem() is None else "sandbox-landlock"

    def check(self) -> None:
        """Raise BenchbotError when this machine can make no sandbox: nothing is run without one instead."""
        filter_program()
        problems = (bubblewrap_problem(), fallback.problem())
        if None not in problems:
            raise BenchbotError(
                "There is no sandbox on this machine, so the solution is not run.",
                f"{_sentence(str(problems[0]))} Landlock, which is weaker, would do: {problems[1]}.",
                "Install bubblewrap (Debian: apt install bubblewrap). Or run the solution in a container "
                "(--containerised), or with everything that you may do yourself, if you trust it: --native.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.INFRASTRUCTURE,
            )

    def describe(self) -> str:
        """Return what holds the solution, in words, for who submits it."""
        problem = bubblewrap_problem()
        return "in a sandbox (bubblewrap)" if problem is None else f"{fallback.WEAKER}. {_sentence(problem)}"

    def start(
        self, spec: "SolutionSpec", connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> AbstractContextManager[Running]:
        """Return the solution in its sandbox; see `docs/sandbox.md`."""
        return self._started(spec, connection, exchange, output)

    @contextmanager
    def _started(
        self, spec: "SolutionSpec", connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> Iterator[Running]:
        self.check()
        socket = unix_socket_of(self, connection)
        bounds = limits.with_defaults(spec.limits)
        path = spec.variables.get("PATH", os.environ.get("PATH", os.defpath))
        hidden = hidden_paths(Catalog(load()), spec.folder)
        view = view_of(spec.command, spec.folder, path, self.readable, hidden)
        environment = {**_environment(view, path), "BENCHBOT_TOKEN": connection.token}
        user = _spare_user() if os.geteuid() == 0 else None
        with ExitStack() as stack:
            group = stack.enter_context(control_group(bounds))
            stack.enter_context(_given_to(user, socket))
            made = (_in_bubblewrap if bubblewrap_problem() is None else _under_landlock)(
                stack, view, socket, exchange, user
            )
            confinement = {
                "user": user,
                "limits": limits.of_each_process(bounds, grouped=group is not None),
                "filter": base64.b64encode(filter_program()).decode(),
                "files": made.rules,
            }
            leading = Leading(
                around=made.around if group is None else group.entering(made.around),
                code=made.code,
                environment={},
                handles=() if made.pipe is None else (made.pipe.input,),
                told={"alone": made.alone, "handover": made.handover, "confinement": confinement},
            )
            variables = {**environment, **made.places, **_safe(spec.variables, view)}
            solution = Solution(spec.command, spec.folder, variables, output, leading)
            held = stack.enter_context(_Held(solution, bounds, group))
            if made.pipe is not None:
                made.pipe.close_input()
            yield held


@dataclass(frozen=True)
class _Made:
    """What differs between the two kinds: see `Leading`; `places` are variables that name paths as they are inside."""

    places: Mapping[str, str]
    alone: bool
    around: list[str] = field(default_factory=list)
    code: Path = CODE
    pipe: ResultPipe | None = None
    handover: Mapping[str, Any] | None = None
    rules: list[tuple[str, int]] | None = None


class _Held:
    """A solution in its sandbox, with an eye on its limits."""

    def __init__(self, solution: Solution, bounds: ProcessLimits, group: ControlGroup | None) -> None:
        self._solution = solution
        self._bounds = bounds
        self._group = group

    def __enter__(self) -> "_Held":
        self._solution.__enter__()
        return self

    def __exit__(self, *_error: object) -> None:
        self.end()

    @property
    def process(self) -> int:
        return self._solution.process

    @property
    def last_words(self) -> str:
        return self._solution.last_words

    def wait(self, timeout_s: float) -> int | None:
        status = self._solution.wait(timeout_s)
        most_s = self._bounds.cpu_time_s
        if status is None and most_s is not None and self._group is not None and self._group.cpu_time_s() > most_s:
            self.end()
            return -signal.SIGXCPU
        return status

    def explain(self, status: int) -> BenchbotError | None:
        if status == 0:
            return None if self._solution.refused is None else _refused(self._solution.refused)
        if self._group is not None and self._group.killed_for_memory():
            return limits.out_of_memory(self._bounds, self.last_words)
        explained = limits.explain(self._bounds, status, self.last_words)
        if explained is None and self._group is not None and self._group.refused_processes():
            return limits.out_of_processes(self._bounds, self.last_words)
        return explained

    def end(self) -> None:
        self._solution.end()


@cache
def bubblewrap_problem() -> str | None:
    """Return why bubblewrap cannot be used on this machine, looked at once; None when it can."""
    return bubblewrap.problem()


def _in_bubblewrap(stack: ExitStack, view: View, socket: Path, exchange: Path, user: int | None) -> _Made:
    pipe = stack.enter_context(result_pipe(exchange / RESULT))
    return _Made(
        places={
            "BENCHBOT_SOCKET": str(bubblewrap.SOCKET_INSIDE),
            "BENCHBOT_RESULT": str(bubblewrap.RESULT_INSIDE),
            "HOME": "/tmp",  # noqa: S108
            "TMPDIR": "/tmp",  # noqa: S108
        },
        alone=True,
        around=bubblewrap.command(view, socket),
        code=bubblewrap.CODE_INSIDE,
        pipe=pipe,
        handover={"path": str(bubblewrap.RESULT_INSIDE), "target": pipe.input, "max_bytes": RESULT_MAX_BYTES},
    )


def _under_landlock(stack: ExitStack, view: View, socket: Path, exchange: Path, user: int | None) -> _Made:
    stack.enter_context(_given_to(user, exchange))
    places = {
        "BENCHBOT_SOCKET": str(socket),
        "BENCHBOT_RESULT": str(exchange / RESULT),
        "HOME": str(exchange),
        "TMPDIR": str(exchange),
    }
    return _Made(places, alone=False, rules=fallback.rules(view, exchange))


@contextmanager
def _given_to(user: int | None, path: Path) -> Iterator[None]:
    """Let a path be another user's for a while; one that was root's is root's again."""
    if user is None:
        yield
        return
    before = path.stat()
    os.chown(path, user, user)
    try:
        yield
    finally:
        os.chown(path, before.st_uid, before.st_gid)


def _spare_user() -> int:
    """Return the number of a user that owns nothing on this machine and runs nothing else, if there is one."""
    wanted = secrets.choice(SPARE_USERS)
    for line in Path("/proc/self/uid_map").read_text().splitlines():
        first, _, count = map(int, line.split())
        if first <= wanted < first + count:
            return wanted
    return NOBODY


def _environment(view: View, path: str) -> dict[str, str]:
    """Return the variables that are passed on; what is not on the list may tell, or hold, what is the user's own."""
    passed_on = {
        name: value
        for name, value in os.environ.items()
        if name in PASSED_ON or name.startswith(PASSED_ON_STARTS) or name.endswith(PASSED_ON_ENDS)
    }
    return {**passed_on, "PATH": _seen(path, view), "PYTHONUNBUFFERED": "1", "USER": "solution", "LOGNAME": "solution"}


def _safe(variables: Mapping[str, str], view: View) -> dict[str, str]:
    return {name: _seen(value, view) if name == "PATH" else value for name, value in variables.items()}


def _seen(path: str, view: View) -> str:
    """Return the folders of PATH that are seen in the sandbox."""
    tops = (*view.shown, *(link for link, _ in view.links))
    folders = [Path(folder) for folder in path.split(os.pathsep) if folder]
    return os.pathsep.join(str(folder) for folder in folders if any(folder.is_relative_to(top) for top in tops))


def _refused(why: str) -> BenchbotError:
    return BenchbotError(
        "The solution's result was refused.",
        f"{_sentence(why)} A result is a regular file of at most {limits.size(RESULT_MAX_BYTES)}.",
        "Write it with json.dump to the file that BENCHBOT_RESULT names.",
        failure=FailureClass.AGENT,
    )


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:].rstrip('.')}."
