"""`benchbot plugins`: list, show and search plug-ins; lock and sync those of a project."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli import list as lists
from benchbot.cli.kit import console
from benchbot.cli.kit.options import QUICK, Json, group
from benchbot.plugins.installer.commands import (
    DryRun,
    ExtraIndexUrl,
    FindLinks,
    IndexUrl,
    InstallerName,
    NoIndex,
    Trust,
    indexes_of,
    perform,
)

if TYPE_CHECKING:
    from benchbot.plugins.installer.distributions import Distribution

app = group("List, show and search plug-ins; lock those of a project.")


@app.callback()
def plugins() -> None:
    """List, show and search plug-ins; lock those of a project."""


app.command("list", context_settings=QUICK)(lists.plugins)


@app.command("show")
def show(name: Annotated[str, typer.Argument(metavar="NAME", help="The distribution.")], as_json: Json = False) -> None:
    """Say what an installed plug-in is, where it came from and what it brings; nothing of it is imported."""
    from packaging.utils import canonicalize_name

    from benchbot.core.errors import BenchbotError, did_you_mean
    from benchbot.core.plugin_manager import installed
    from benchbot.plugins.installer.distributions import found_in
    from benchbot.plugins.v2 import addons

    folders = dict.fromkeys(Path(folder) for folder in sys.path)
    found = {key: one for key, one in found_in(folders).items() if one.is_plugin}
    wanted = canonicalize_name(name)
    if wanted in found:
        row = plugin_row(found[wanted])
    elif "/" in name and (addons.installed_folder() / name).is_dir():
        row = addon_row(name)
    else:
        known = sorted({str(canonicalize_name(info.distribution)) for info in installed()})
        raise BenchbotError(
            f"{name} is not an installed plug-in.",
            f"Installed: {', '.join(known)}.{did_you_mean(name, known)}",
            f"Install it: benchbot install {name}",
        )
    if as_json:
        console.data_json(row)
        return
    for key, value in row.items():
        text = ", ".join(f"{name} = {target}" for name, target in value.items()) if isinstance(value, dict) else value
        console.data(f"{key:<13} {', '.join(text) if isinstance(text, list) else text}".rstrip())


def plugin_row(distribution: "Distribution") -> dict[str, Any]:
    """Return what `show` says of a plug-in."""
    from benchbot.plugins.installer.code_scan import code_in
    from benchbot.plugins.installer.distributions import GROUP, origin_text

    code = code_in(distribution)
    return {
        "name": distribution.name,
        "version": distribution.version,
        "summary": distribution.metadata.metadata["Summary"] or "",
        "from": origin_text(distribution.origin),
        "editable": distribution.is_editable,
        "brings": "code" if code or distribution.is_editable else "declarations",
        "code": code,
        "requires": sorted(distribution.requires()),
        "entry_points": {point.name: point.value for point in distribution.metadata.entry_points.select(group=GROUP)},
        "path": str(distribution.info.parent),
    }


def addon_row(name: str) -> dict[str, Any]:
    """Return what `show` says of an add-on folder of BenchBot v2."""
    from benchbot.plugins.installer import addons
    from benchbot.plugins.v2 import addons as v2_addons

    addon = v2_addons.find(v2_addons.installed()[name])
    code = sorted(addons.python_files(addon))
    return {
        "name": name,
        "version": "v2",
        "summary": "add-ons of BenchBot v2",
        "from": addons.origin_of(name),
        "brings": "code" if code else "declarations",
        "code": code,
        "path": str(addon.root),
    }


@app.command("search")
def search_indexes(
    word: Annotated[str, typer.Argument(metavar="WORD", help="Part of the name, the kind or the summary.")],
    index_url: IndexUrl = None,
    extra_index_url: ExtraIndexUrl = None,
    as_json: Json = False,
) -> None:
    """List what a package index offers: names that begin with benchbot-, with kind and summary, that hold a word."""
    from dataclasses import asdict

    from benchbot.plugins.installer.index_search import search
    from benchbot.plugins.installer.indexes import without_credentials

    addresses = indexes_of(index_url, extra_index_url, False, None).addresses
    console.note(f"Reading the list of names of {', '.join(map(without_credentials, addresses))} …")
    found = search(word, addresses)
    if as_json:
        console.data_json([asdict(offer) for offer in found])
    else:
        console.table(("name", "kind", "summary"), [(one.name, one.kind or "-", one.summary or "-") for one in found])
    console.note(f"{len(found)} found.{'' if found else ' Names that do not begin with benchbot- are not looked at.'}")


LockFile = Annotated[Path, typer.Option("--lock", metavar="FILE", help="The lock.")]


@app.command("lock")
def lock(
    path: LockFile = Path("benchbot.lock"),
    index_url: IndexUrl = None,
    extra_index_url: ExtraIndexUrl = None,
    no_index: NoIndex = False,
    find_links: FindLinks = None,
    installer: InstallerName = None,
) -> None:
    """Write the installed plug-ins and what they need, with versions and hashes, to a file; prints its path."""
    from benchbot.plugins.installer import lockfile
    from benchbot.plugins.installer.change import target_environment

    indexes = indexes_of(index_url, extra_index_url, no_index, find_links)
    with target_environment(installer, "benchbot plugins lock") as target:
        locked = lockfile.lock(target.installed, target.installer, indexes)
    lockfile.write(path, locked)
    console.data(str(path))
    console.note(f"{len(locked)} distributions locked. Apply it with: benchbot plugins sync")


@app.command("sync")
def sync(
    path: LockFile = Path("benchbot.lock"),
    trust: Trust = False,
    dry_run: DryRun = False,
    index_url: IndexUrl = None,
    extra_index_url: ExtraIndexUrl = None,
    no_index: NoIndex = False,
    find_links: FindLinks = None,
    installer: InstallerName = None,
    as_json: Json = False,
) -> None:
    """Make the plug-ins of this environment those of a lock: install, change, uninstall. Prints what has changed."""
    from benchbot.plugins.installer import lockfile
    from benchbot.plugins.installer.change import InstallRequest, TargetEnvironment

    locked = lockfile.read(path)

    def request(target: TargetEnvironment) -> InstallRequest:
        sources, remove, notes = lockfile.difference(locked, target.installed)
        for note in notes:
            console.note(note)
        return InstallRequest(
            sources,
            remove=remove,
            indexes=indexes_of(index_url, extra_index_url, no_index, find_links),
            require_hashes=True,
            no_dependencies=True,
            may_build=trust,
            dry_run=dry_run,
        )

    perform(f"benchbot plugins sync --lock {path}", request, installer, as_json=as_json)
