"""The submission mode `sandbox` (`benchbot.submission.modes.Holder`): bubblewrap, or Landlock where there is none.

Its options: `readable`, the paths of this machine that a solution may read besides what it needs; `weak_limits`,
whether limits that were asked for may hold for each of its processes by itself.
"""

import base64
import os
import secrets
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from benchbot.cli.kit.holding import SANDBOX
from benchbot.cli.kit.preflight import Intent
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.findings import Finding, Level
from benchbot.core.plugin_manager import load
from benchbot.plugins.sandbox import bubblewrap, landlock
from benchbot.plugins.sandbox.control_group import ControlGroup, control_group
from benchbot.plugins.sandbox.syscalls import filter_program
from benchbot.plugins.sandbox.view import View, hidden_paths, view_of
from benchbot.plugins.sandbox.weak_limits import CPU_TIME, DISK, MEMORY, NO_GROUP, refused, weak_limits
from benchbot.submission import limits
from benchbot.submission.modes import (
    RESULT,
    RESULT_MAX_BYTES,
    ProcessLimits,
    Running,
    SolutionSpec,
    owned_by,
    unix_socket_of,
)
from benchbot.submission.output import refused_result
from benchbot.submission.solution import InitOptions, Solution
from benchbot.wire.run_state import Connection

PASSED_ON = ("LANG", "LANGUAGE", "TZ", "PYTHONHASHSEED", "PYTHONUTF8")
PASSED_ON_ENDS = ("_NUM_THREADS",)
PASSED_ON_STARTS = ("LC_",)
SPARE_USERS = range(2_000_000_000, 2_100_000_000)
NOBODY = 65534


def resolved(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options with absolute paths; raises BenchbotError for one that is not there, and for v2's client."""
    if options.get("v2_client"):
        raise BenchbotError(
            "BenchBot v2's client cannot run in a sandbox.",
            "It needs a network, and there is none.",
            "Run it natively, --v2-client --native COMMAND; or in a container, --v2-client --containerised FOLDER",
        )
    paths = [Path(path).absolute() for path in options.get("readable", ())]
    for path in paths:
        if not path.exists():
            raise BenchbotError(f"There is no {path}.", "--readable names it.", "Name a file or folder that is there.")
    return {"readable": [str(path) for path in paths], "weak_limits": bool(options.get("weak_limits"))}


@contextmanager
def prepared(spec: SolutionSpec, options: Mapping[str, Any], tell: Callable[[str], object]) -> Iterator[SolutionSpec]:
    """Yield the specification in a sandbox; raises BenchbotError when there can be none on this machine.

    So it does for limits that were asked for and cannot hold here, unless weak ones are allowed.
    """
    yield _sandboxed(spec, options)


def check(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield how solutions that are to be sandboxed are held; raises BenchbotError when they cannot be, here."""
    for each in [each for each in intent.submissions if each.mode == SANDBOX]:
        held = _sandboxed(each.spec, each.options)
        weak = f"; weak limits: {', '.join(held.weak_limits)}" if held.weak_limits else ""
        yield Finding(Level.OK, "held", f"{held.mode.describe()}{weak}")


def _sandboxed(spec: SolutionSpec, options: Mapping[str, Any]) -> SolutionSpec:
    sandbox = Sandbox(tuple(map(Path, options["readable"])))
    sandbox.check()
    weak = weak_limits(spec.limits, allowed=options.get("weak_limits", False))
    # Without bubblewrap it writes into a folder of this machine.
    return replace(spec, mode=sandbox, weak_limits=weak if bubblewrap_problem() is None else (*weak, DISK))


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
        problems = (bubblewrap_problem(), landlock.problem())
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
        """Return the kind of sandbox as a part of a sentence."""
        problem = bubblewrap_problem()
        return "in a sandbox (bubblewrap)" if problem is None else f"{landlock.WEAKER}. {_sentence(problem)}"

    @contextmanager
    def start(
        self, spec: SolutionSpec, connection: Connection, exchange: Path, output: Callable[[bytes], object]
    ) -> Iterator[Running]:
        """Yield the solution in its sandbox; see `docs/sandbox.md`."""
        self.check()
        socket = unix_socket_of(self, connection)
        bounds = limits.with_defaults(spec.limits)
        path = spec.variables.get("PATH", os.environ.get("PATH", os.defpath))
        hidden = hidden_paths(Catalog(load()), spec.folder, self.readable, connection)
        view = view_of(spec.command, spec.folder, path, self.readable, hidden)
        user = _spare_user() if os.geteuid() == 0 else None
        owner = None if user is None else (user, user)
        with ExitStack() as stack:
            group = stack.enter_context(control_group(bounds))
            if group is None and MEMORY not in spec.weak_limits:
                raise refused([MEMORY, CPU_TIME], NO_GROUP)
            stack.enter_context(owned_by(owner, socket))
            confinement = {
                "user": user,
                "limits": limits.of_each_process(bounds, grouped=group is not None),
                "filter": base64.b64encode(filter_program()).decode(),
                "files": None,
            }
            if bubblewrap_problem() is None:
                pipe = stack.enter_context(bubblewrap.ResultPipe(exchange / RESULT))
                seen_socket, result, home = bubblewrap.SOCKET_INSIDE, bubblewrap.RESULT_INSIDE, Path("/tmp")  # noqa: S108
                handover = {"path": str(result), "target": pipe.input, "max_bytes": RESULT_MAX_BYTES}
                wrapper, wrapper_options = stack.enter_context(bubblewrap.command(view, socket))
                init = InitOptions(
                    wrapper=wrapper,
                    code=bubblewrap.CODE_INSIDE,
                    environment={},
                    handles=(pipe.input, wrapper_options),
                    job={"alone": True, "handover": handover, "confinement": confinement},
                )
            else:
                pipe = None
                stack.enter_context(owned_by(owner, exchange))
                seen_socket, result, home = socket, exchange / RESULT, exchange
                rules = {"files": landlock.rules(view, exchange)}
                init = InitOptions(environment={}, job={"alone": False, "confinement": {**confinement, **rules}})
            if group is not None:
                init = replace(init, wrapper=[*group.entering, *init.wrapper])
            variables = {
                **_environment(),
                "PATH": path,
                "BENCHBOT_TOKEN": connection.token,
                "BENCHBOT_SOCKET": str(seen_socket),
                "BENCHBOT_RESULT": str(result),
                "HOME": str(home),
                "TMPDIR": str(home),
                **spec.variables,
            }
            variables["PATH"] = _seen(variables["PATH"], view)
            solution = _SandboxedSolution(spec, variables, output, init, bounds, group)
            held = stack.enter_context(solution)
            if pipe is not None:
                pipe.close_input()
            yield held


class _SandboxedSolution(Solution):
    """A solution in its sandbox, whose limits are watched."""

    def __init__(
        self,
        spec: SolutionSpec,
        variables: Mapping[str, str],
        output: Callable[[bytes], object],
        init: InitOptions,
        bounds: ProcessLimits,
        group: ControlGroup | None,
    ) -> None:
        super().__init__(spec.command, spec.folder, variables, output, init)
        self._bounds = bounds
        self._group = group

    def wait(self, timeout_s: float) -> int | None:
        status = super().wait(timeout_s)
        if status is None and self._has_used_its_cpu_time():
            self.end()
            return -signal.SIGXCPU
        return status

    def explain(self, status: int) -> BenchbotError | None:
        if self._has_used_its_cpu_time():
            return limits.explain(self._bounds, -signal.SIGXCPU, self.last_words)
        if status == 0:
            return None if self.refused is None else refused_result(self.refused)
        if self._group is not None and self._group.killed_for_memory():
            return limits.out_of_memory(self._bounds, self.last_words)
        explained = limits.explain(self._bounds, status, self.last_words)
        if explained is None and self._group is not None and self._group.refused_processes():
            return limits.out_of_processes(self._bounds, self.last_words)
        return explained

    def _has_used_its_cpu_time(self) -> bool:
        most_s = self._bounds.cpu_time_s
        return most_s is not None and self._group is not None and self._group.cpu_time_s() > most_s


@cache
def bubblewrap_problem() -> str | None:
    """Return the reason why bubblewrap cannot be used on this machine, checked once; None when it can."""
    return bubblewrap.problem()


def _spare_user() -> int:
    """Return the number of a user that owns nothing on this machine and runs nothing else, if there is one."""
    wanted = secrets.choice(SPARE_USERS)
    for line in Path("/proc/self/uid_map").read_text().splitlines():
        first, _, count = map(int, line.split())
        if first <= wanted < first + count:
            return wanted
    return NOBODY


def _environment() -> dict[str, str]:
    """Return the variables that are passed on; others may tell, or hold, what is the user's own."""
    passed_on = {
        name: value
        for name, value in os.environ.items()
        if name in PASSED_ON or name.startswith(PASSED_ON_STARTS) or name.endswith(PASSED_ON_ENDS)
    }
    return {**passed_on, "PYTHONUNBUFFERED": "1", "USER": "solution", "LOGNAME": "solution"}


def _seen(path: str, view: View) -> str:
    """Return the folders of PATH that are seen in the sandbox."""
    tops = (*view.shown, *(link for link, _ in view.links))
    folders = [Path(folder) for folder in path.split(os.pathsep) if folder]
    return os.pathsep.join(str(folder) for folder in folders if any(folder.is_relative_to(top) for top in tops))


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:].rstrip('.')}."
