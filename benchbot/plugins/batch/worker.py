"""A worker of a batch: `python -m benchbot.plugins.batch.worker FOLDER --name NAME`.

It claims one pending episode after another and computes it, preferring those of the scene that its simulator has
loaded; while others hold the last ones it waits, in case they are lost. The first worker of a detached batch that has
nothing left evaluates the results. It can be killed at any moment; SIGTERM, SIGINT and SIGHUP end it in order.
Exit codes: 0 nothing is left that it may take · 3 it cannot work (its output says why) · 130 it was told to end.
"""

import argparse
import os
import signal
import sys
import time
from contextlib import ExitStack
from pathlib import Path

from benchbot.cli.kit import console
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.plugin_manager import load
from benchbot.core.request import AUTO
from benchbot.plugins.batch import episode_run, machine, plan, solutions
from benchbot.plugins.batch.attempts import NotWantedError
from benchbot.plugins.batch.claims import Heartbeat, HeldClaim, Observer
from benchbot.plugins.batch.early_end import Canaries
from benchbot.plugins.batch.episode_run import EpisodeContext, WarmBackend
from benchbot.plugins.batch.folder import Folder, check_writable
from benchbot.plugins.batch.journal import EventLog
from benchbot.plugins.batch.machine import MemoryWatch
from benchbot.plugins.batch.pending import Pending
from benchbot.plugins.batch.plan import PlannedEpisode
from benchbot.plugins.batch.worker_pool import WorkerPool

IDLE_S = 0.5
THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "TI_CPU_MAX_NUM_THREADS",
)
"""The variables that numerical libraries and Taichi read their number of threads from; a user's own stay."""


class Worker:
    """Takes and finishes episodes, one at a time. The resources of its solution are released with `stack`."""

    def __init__(self, folder: Folder, name: str, stack: ExitStack) -> None:
        self._plan = plan.read(folder.plan)
        for needed in (folder.claims, folder.events, folder.episodes):
            check_writable(needed)
        self._folder = folder
        self._name = name
        self._events = EventLog(folder.events, name)
        self._observer = Observer(folder.claims, self._plan.policy.stale_s)
        catalog, pool = Catalog(load()), WorkerPool.read(folder)
        gpus = pool.resources.gpus
        prepared = {
            solution: stack.enter_context(solutions.prepared(alone, catalog, folder.solutions, print, gpus))
            for solution, alone in self._plan.each().items()
        }
        needs_socket = any(solution.spec.mode.needs_socket for solution in prepared.values())
        # A cluster names the GPUs that it has given to a worker. One that it can see beside is somebody else's.
        may_look = pool.executor == "local" or bool(os.environ.get("CUDA_VISIBLE_DEVICES"))
        device = AUTO if may_look else "cpu"
        self._backend = WarmBackend(self._plan, folder.path, needs_socket=needs_socket, device=device)
        memory = MemoryWatch(os.getpid())
        self._context = EpisodeContext(
            folder, self._plan, catalog, self._backend, self._events, name, memory, prepared, gpus
        )
        self._canaries = Canaries(folder, self._plan)
        self._left = Pending(self._plan.episodes, name)
        self.told_to_end = False

    def stop(self, *_: object) -> None:
        """End in order, soon. As a signal handler, it may interrupt anything, and does no more than this."""
        self.told_to_end = True

    def run(self, limit: int | None) -> int:
        """Work until nothing is left, or `limit` episodes are finished, or it is told to stop; return how many were."""
        self._events.tell("started", pid=os.getpid())
        finished = 0
        idle = False
        try:
            while not self.told_to_end and (limit is None or finished < limit):
                try:
                    taken = self._next()
                except OSError as error:
                    if not machine.is_disk_full(error):
                        raise
                    time.sleep(machine.POLL_S)
                    taken = None
                if taken is not None:
                    idle = False
                    finished += self._compute(*taken)
                elif not self._left:
                    break
                else:
                    if not idle:
                        self._events.tell("idle")
                        self._load_ahead()
                    idle = True
                    time.sleep(IDLE_S)
        finally:
            self._backend.close()
            self._events.tell("ended", finished=finished, told=self.told_to_end)
        return finished

    def finalize(self) -> None:
        """Evaluate a detached batch that is finished; raises OSError and BenchbotError."""
        if not self._left and not self.told_to_end and WorkerPool.read(self._folder).detached:
            # Few workers come here, all of them at the very end.
            from benchbot.plugins.batch.finalization import finalize

            def evaluate() -> None:
                finalize(self._folder, self._plan, self._context.catalog, self._name)

            def tell(error: Exception) -> None:
                self._events.tell("paused", why=str(error).replace("\n", " "))

            machine.when_there_is_room(evaluate, lambda: not self.told_to_end, tell)

    def _next(self) -> tuple[HeldClaim, PlannedEpisode] | None:
        """Return the claim of the next episode, or None when there is none that may be taken now.

        Raises BenchbotError when a canary has failed.
        """
        self._canaries.check()
        claimed = self._observer.keys()
        for episode in self._left.of(claimed):
            if self._observer.is_stale(episode.key):
                self._steal(episode)
        claimed = self._observer.keys()
        for episode in self._left.candidates(claimed, self._backend.scene):
            if self._canaries.holds_back(episode) or self._drop_if_finished(episode):
                continue
            claim = HeldClaim.take(self._folder.claims / episode.key, self._name)
            if claim is None:
                continue
            # Another worker may have finished it before the claim.
            if not self._drop_if_finished(episode):
                return claim, episode
            claim.release()
        for episode in self._left.of(claimed):
            self._drop_if_finished(episode)
        return None

    def _load_ahead(self) -> None:
        """Load what the next episode is simulated in, where it waits for a canary."""
        waiting = filter(self._canaries.holds_back, self._left.candidates(self._observer.keys(), self._backend.scene))
        episode = next(waiting, None)
        if episode is not None:
            self._backend.warm_up(episode)

    def _drop_if_finished(self, episode: PlannedEpisode) -> bool:
        """Forget an episode that has its result; say whether it has."""
        finished = self._folder.attempts(episode).finished() is not None
        if finished:
            self._left.drop(episode)
        return finished

    def _steal(self, episode: PlannedEpisode) -> None:
        stolen = self._observer.steal(episode.key)
        if stolen is not None:
            self._events.tell("stole", key=episode.key, worker=stolen.worker)
        self._folder.attempts(episode).end_orphan()

    def _compute(self, claim: HeldClaim, episode: PlannedEpisode) -> bool:
        """Compute an episode; say whether it is finished."""
        began_s = time.monotonic()
        try:
            with Heartbeat(claim, self._plan.policy.stale_s):
                failure = episode_run.finish(self._context, episode, lambda: not self.told_to_end and claim.is_mine)
        except NotWantedError:
            self._events.tell("let go", key=episode.key)
            return False
        except OSError as error:
            if not machine.is_disk_full(error):
                raise
            self._events.tell("let go", key=episode.key, why=f"{error.filename}: {error.strerror}")
            time.sleep(machine.POLL_S)
            return False
        finally:
            claim.release()
        self._left.drop(episode)
        duration_s = round(time.monotonic() - began_s, 3)
        self._events.tell("finished", key=episode.key, failure=failure, duration_s=duration_s)
        return True


def main() -> int:
    """Run a worker by its command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchbot.plugins.batch.worker", description=__doc__)
    parser.add_argument("folder", type=Path, help="the folder of the batch")
    parser.add_argument("--name", required=True, help="a name that no other worker of the batch has had")
    parser.add_argument("--cpus", type=int, help="threads of the simulator and of numerical libraries")
    parser.add_argument("--jobs-limit", type=int, metavar="N", help="end after N episodes")
    options = parser.parse_args()
    if options.cpus is not None:
        for variable in THREADS:
            os.environ.setdefault(variable, str(options.cpus))
    try:
        with ExitStack() as stack:
            worker = Worker(Folder(options.folder.absolute()), options.name, stack)
            for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
                signal.signal(number, worker.stop)
            worker.run(options.jobs_limit)
        worker.finalize()
    except (BenchbotError, OSError) as error:
        console.note(*str(error).splitlines())
        return ExitCode.INTERNAL
    return ExitCode.INTERRUPTED if worker.told_to_end else ExitCode.OK


if __name__ == "__main__":
    sys.exit(main())
