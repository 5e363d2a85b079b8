"""`benchbot install`, `uninstall` and `upgrade`: plug-ins and v2's add-ons in this environment."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.console import interruptible
from benchbot.cli.kit.options import Json

if TYPE_CHECKING:
    from benchbot.plugins.installer.change import InstallRequest, TargetEnvironment
    from benchbot.plugins.installer.distributions import Distribution
    from benchbot.plugins.installer.indexes import Indexes

InstallerName = Annotated[
    str | None,
    typer.Option("--installer", metavar="uv|pip", help="What installs. [default: uv where there is one, else pip]"),
]
Trust = Annotated[bool, typer.Option("--trust", help="Let the code that comes run; remembered until it changes.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Print what would change, and change nothing.")]
RequireHashes = Annotated[bool, typer.Option("--require-hashes", help="Install only what a hash is given for.")]
IndexUrl = Annotated[str | None, typer.Option("--index-url", metavar="URL", help="The package index. [default: PyPI]")]
ExtraIndexUrl = Annotated[
    list[str] | None, typer.Option("--extra-index-url", metavar="URL", help="Another index, besides; repeatable.")
]
NoIndex = Annotated[bool, typer.Option("--no-index", help="Ask no index: only what --find-links names.")]
FindLinks = Annotated[
    list[Path] | None, typer.Option("--find-links", metavar="DIR", help="A folder of wheels; repeatable.")
]


def install(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME[==V]|PATH|GIT-URL|WHEEL…",
            help="From an index by name; a project's folder; a git repository; a wheel; or a folder or repository of "
            "BenchBot v2's add-ons.",
        ),
    ] = None,
    requirements: Annotated[
        list[Path] | None,
        typer.Option("--requirements", "-r", metavar="FILE", help="A file with one of them on each line; repeatable."),
    ] = None,
    trust: Trust = False,
    dry_run: DryRun = False,
    require_hashes: RequireHashes = False,
    index_url: IndexUrl = None,
    extra_index_url: ExtraIndexUrl = None,
    no_index: NoIndex = False,
    find_links: FindLinks = None,
    installer: InstallerName = None,
    as_json: Json = False,
) -> None:
    """Install plug-ins: look what would change, ask where code comes, install, check; what fails is undone.

    Prints what has changed.
    """
    from benchbot.core.errors import BenchbotError
    from benchbot.plugins.installer.change import InstallRequest
    from benchbot.plugins.installer.sources import read_requirements

    named = [*(sources or ()), *(line for path in requirements or () for line in read_requirements(path))]
    wanted = [source for name in named for source in _in_its_place(name)]
    if not named:
        raise BenchbotError(
            "Nothing was named.", "There is nothing to install.", "Write: benchbot install NAME, or -r FILE"
        )
    request = InstallRequest(
        wanted,
        indexes=indexes_of(index_url, extra_index_url, no_index, find_links),
        require_hashes=require_hashes,
        may_build=trust,
        dry_run=dry_run,
    )
    perform(f"benchbot install {' '.join(wanted)}", lambda _: request, installer, as_json=as_json)


def _in_its_place(name: str) -> list[str]:
    """Return the plug-ins that ship what an official add-on of BenchBot v2 had, and say so; else the name itself."""
    from benchbot.plugins.v2 import official

    replacement = official.replacement_of(name)
    if replacement is None:
        return [name]
    console.note(
        f"{name} ships as {', '.join(replacement.distributions)}{': ' * bool(replacement.differs)}"
        f"{replacement.differs}."
    )
    return [distribution for distribution in replacement.distributions if distribution != "benchbot"]


def uninstall(
    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Distributions, or add-ons as user/repository.")],
    with_unused: Annotated[
        bool, typer.Option("--with-unused", help="And what they needed, if nothing else does and nobody asked for it.")
    ] = False,
    dry_run: DryRun = False,
    installer: InstallerName = None,
    as_json: Json = False,
) -> None:
    """Uninstall plug-ins; what they needed stays, and is named where nothing else needs it. Prints what has changed."""
    from benchbot.plugins.installer.change import InstallRequest

    request = InstallRequest(remove=list(dict.fromkeys(names)), with_unused=with_unused, dry_run=dry_run)
    perform(f"benchbot uninstall {' '.join(names)}", lambda _: request, installer, as_json=as_json)


def upgrade(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="NAME…", help="Plug-ins and add-ons. [default: all]")
    ] = None,
    trust: Trust = False,
    dry_run: DryRun = False,
    index_url: IndexUrl = None,
    extra_index_url: ExtraIndexUrl = None,
    no_index: NoIndex = False,
    find_links: FindLinks = None,
    installer: InstallerName = None,
    as_json: Json = False,
) -> None:
    """Upgrade plug-ins to the newest versions that fit together, from where each came. Prints what has changed."""
    from benchbot.plugins.installer.change import InstallRequest

    def request(target: "TargetEnvironment") -> "InstallRequest":
        sources, newest = _upgradable(names or (), target.installed)
        indexes = indexes_of(index_url, extra_index_url, no_index, find_links)
        return InstallRequest(sources, upgrade=newest, indexes=indexes, may_build=trust, dry_run=dry_run)

    perform(" ".join(["benchbot upgrade", *(names or ())]), request, installer, as_json=as_json)


def _upgradable(names: Sequence[str], installed: "Mapping[str, Distribution]") -> tuple[list[str], frozenset[str]]:
    """Return the sources that plug-ins and add-ons came from, and the normalized names of those from an index.

    Without names, of all that are installed. Raises BenchbotError for a name that is not installed.
    """
    from packaging.utils import canonicalize_name

    from benchbot.core.errors import BenchbotError, did_you_mean
    from benchbot.plugins.installer import addons
    from benchbot.plugins.v2 import addons as v2_addons

    plugins = {name: one for name, one in installed.items() if one.is_plugin and name != "benchbot"}
    known = [*plugins, *v2_addons.installed()]
    sources, newest = list[str](), set[str]()
    for name in names or known:
        key = name if name in known else canonicalize_name(name)
        if key == "benchbot":
            raise BenchbotError(
                "BenchBot does not upgrade itself.",
                "It would have to change what is running.",
                "Do it with what has installed it: pip install --upgrade benchbot, or uv pip install -U benchbot",
            )
        if key not in known:
            raise BenchbotError(
                f"{name} is not installed.",
                f"Installed: {', '.join(sorted(known)) or 'none'}.{did_you_mean(name, known)}",
                f"Install it: benchbot install {name}",
            )
        origin: Mapping[str, Any] | None = plugins[key].origin if key in plugins else {"url": addons.origin_of(key)}
        if origin is None:
            sources.append(key)
            newest.add(key)
        elif "vcs_info" in origin:
            revision = origin["vcs_info"].get("requested_revision")
            sources.append(f"git+{origin['url']}{f'@{revision}' if revision else ''}")
        elif key not in plugins and "://" in origin["url"]:
            sources.append(origin["url"])
        else:
            console.note(f"{key} stays: it came from a file or folder. Install it from there again.")
    return sources, frozenset(newest)


def indexes_of(
    index_url: str | None, extra_index_url: list[str] | None, no_index: bool, find_links: list[Path] | None
) -> "Indexes":
    """Return the indexes that options name."""
    from benchbot.plugins.installer.indexes import Indexes

    return Indexes(index_url, tuple(extra_index_url or ()), no_index, tuple(find_links or ()))


def perform(
    command: str,
    request: "Callable[[TargetEnvironment], InstallRequest]",
    installer: str | None,
    *,
    as_json: bool,
) -> None:
    """Carry out a request in the environment of this process, and print what has changed.

    `command` is shown to processes that wait meanwhile; `request` is called once the environment is locked.
    """
    from benchbot.plugins.installer.change import change, target_environment
    from benchbot.plugins.installer.indexes import without_credentials

    shown = without_credentials(command)
    with interruptible("nothing was changed."), target_environment(installer, shown) as target:
        requested = request(target)
        plan = change(target, requested, shown)
    if as_json:
        console.data_json(plan.as_dict(installer=target.installer.name, done=not requested.dry_run))
    elif plan.changes:
        console.data(*map(str, plan.changes))
    if not plan.changes:
        console.note("Nothing to do: everything is there already.")
    elif not requested.dry_run:
        console.note("Done.")
