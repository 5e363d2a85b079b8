"""The solution of a batch: its files, kept in the batch's folder, and how they are run on this machine.

Natively each episode works in a copy of the snapshot, in a sandbox it sees the snapshot itself, and the image of a
container is built from it.
"""

import os
import stat
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import file_digest
from pathlib import Path
from typing import Any

from benchbot.cli.kit.holding import CONTAINER, NATIVE, SANDBOX, UNHELD
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.provenance import solution_details
from benchbot.evaluation import batch_folder
from benchbot.plugins.batch.plan import Hold, Plan, PlannedSolution
from benchbot.plugins.batch.source_files import SourceFiles, find
from benchbot.plugins.bundles.snapshot import Content, Snapshot
from benchbot.plugins.bundles.snapshot_store import store
from benchbot.submission.modes import SolutionSpec, holder_of, spec_of, split_words

IMAGE = "container"
"""The word for a container's command in a plan."""


@dataclass(frozen=True)
class PreparedSolution:
    """A solution that this machine can run, and the snapshot that is run."""

    spec: SolutionSpec
    snapshot: Snapshot

    @contextmanager
    def placed(self, attempt: Path) -> Iterator[SolutionSpec]:
        """Yield what is run in an attempt; what a native solution writes where it runs stays in the attempt's folder.

        Raises OSError, and ChangedError when the snapshot is not what it was.
        """
        if self.spec.mode.name not in UNHELD:
            yield self.spec
            return
        with self.snapshot.copied(attempt / batch_folder.WORK):
            yield _located(self.spec, self.snapshot, attempt / batch_folder.WORK, os.environ)


@contextmanager
def prepared(
    plan: Plan, catalog: Catalog, folder: Path, tell: Callable[[str], object], gpus: int = 0
) -> Iterator[PreparedSolution]:
    """Yield the solution of a plan, whose snapshot is in `folder`, after proving that this machine can run it.

    `tell` hears of a build. Raises BenchbotError when its command is not there, nothing here can hold it as the plan
    says, or the snapshot is damaged.
    """
    snapshot = Snapshot.opened(folder / plan.solution.snapshot)
    mode, options = plan.solution.hold.in_mode(gpus)
    spec = replace(unheld(plan, catalog), details=snapshot.details)
    if mode == NATIVE:
        yield PreparedSolution(spec, snapshot)
        return
    if mode == SANDBOX:
        spec = _located(spec, snapshot, snapshot.files, {})
        options = {**options, "readable": (*options["readable"], str(snapshot.files))}
    elif mode == CONTAINER:
        context = snapshot.files / snapshot.content.folder
        options = {**options, "context": str(context), "dockerfile": _dockerfile(options["dockerfile"], snapshot)}
    with holder_of(catalog.plugins, mode).prepared(spec, options, tell) as held:
        image = {"command": held.command} if mode == CONTAINER else {}
        yield PreparedSolution(replace(held, details={**snapshot.details, **image}), snapshot)


def unheld(plan: Plan, catalog: Catalog) -> SolutionSpec:
    """Return what a plan's solution runs, before a mode holds it; an image says itself what runs in its container."""
    solution, hold = plan.solution, plan.solution.hold
    if hold.context is not None:
        spec = SolutionSpec(list(solution.words), Path(solution.folder), timeout_s=plan.timeout_s)
    elif solution.native is None:
        spec = spec_of(catalog, None, solution.example, list(solution.words), plan.timeout_s)
    else:
        words = [*split_words("--native", solution.native), *solution.words]
        spec = SolutionSpec(words, Path(solution.folder), timeout_s=plan.timeout_s)
    return replace(spec, limits=hold.limits, log_limit_bytes=plan.policy.log_limit_bytes)


def files(command: Sequence[str], folder: Path, solution: PlannedSolution) -> SourceFiles:
    """Return the files that make a solution what it is, as they are now; raises BenchbotError."""
    if solution.hold.context is None:
        found = find(command, folder, solution.source)
        # Beside an example lie others, which are not the user's to add.
        return found if solution.example is None else replace(found, left_out=())
    if solution.source:
        raise BenchbotError(
            "--source names files of a command.",
            "All that its image is built from belongs to a container, but for what .dockerignore names.",
            "Leave --source out.",
        )
    return _image_files(solution.hold)


def keep(found: SourceFiles, command: Sequence[str], folder: Path, target: Path, tell: Callable[[str], object]) -> None:
    """Put the snapshot of a solution, whose command runs in `folder`, into `target`.

    Raises BenchbotError when it cannot be written, or a file was edited since it was found.
    """
    at = {word: os.path.relpath(folder / word, found.origin) for word in command[1:]}
    named = {word: found.content.files[name] for word, name in at.items() if name in found.content.files}
    details = {**solution_details(list(command), folder), "files": named, "snapshot": found.content.hash}
    store(target, found.content, found.origin, ran_in=folder, details=details, left_out=found.left_out, tell=tell)


def _located(spec: SolutionSpec, snapshot: Snapshot, root: Path, environment: Mapping[str, str]) -> SolutionSpec:
    """Return what is run where the files of a snapshot lie below `root`; no module is imported from its origin."""
    searched = [str(root / name) for name in snapshot.content.search]
    origins = [snapshot.origin / name for name in snapshot.content.search]
    entries = environment.get("PYTHONPATH", "").split(os.pathsep)
    others = [entry for entry in entries if entry and Path(os.path.normpath(spec.folder / entry)) not in origins]
    path = {"PYTHONPATH": os.pathsep.join([*searched, *others])} if searched else {}
    return replace(
        spec,
        command=[snapshot.moved(word, root) for word in spec.command],
        folder=root / snapshot.content.folder,
        variables={**spec.variables, **path},
    )


def _image_files(hold: Hold) -> SourceFiles:
    """Return all that an image is built from."""
    from benchbot.plugins.containers.context import Context

    context = Context(Path(str(hold.context)), str(hold.dockerfile))
    dockerfile = context.folder / context.dockerfile
    origin = Path(os.path.commonpath([context.folder, dockerfile.parent]))
    hashes: dict[str, str] = {}
    links: dict[str, str] = {}
    folders, executable = [], []
    for path in dict.fromkeys((dockerfile, *(context.folder / name for name in context.names))):
        name, mode = path.relative_to(origin).as_posix(), path.lstat().st_mode
        if stat.S_ISLNK(mode):
            links[name] = str(path.readlink())
        elif stat.S_ISDIR(mode):
            folders.append(name)
        elif stat.S_ISREG(mode):
            with path.open("rb") as file:
                hashes[name] = file_digest(file, "sha256").hexdigest()
            if mode & stat.S_IXUSR:
                executable.append(name)
    folder = context.folder.relative_to(origin).as_posix()
    content = Content(folder, hashes, tuple(executable), (), links, tuple(folders or [folder]))
    return SourceFiles(content, origin)


def _dockerfile(named: Any, snapshot: Snapshot) -> str:
    """Return the Dockerfile in a snapshot: below the folder of the image, or where it lies beside it."""
    path = Path(str(named))
    return str(snapshot.files / path.relative_to(snapshot.origin)) if path.is_absolute() else str(path)
