"""What there is to upgrade, and where each plug-in came from, so that it comes from there again."""

from collections.abc import Mapping, Sequence

from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.plugins.installer import addons
from benchbot.plugins.installer.distributions import Distribution, normal
from benchbot.plugins.v2 import addons as v2_addons


def sources(names: Sequence[str], installed: Mapping[str, Distribution]) -> tuple[list[str], frozenset[str], list[str]]:
    """Return what to install anew, the normal names of which the newest version is wanted, and notes on what stays.

    Without names, all that can be upgraded. Raises BenchbotError for a name that is not installed.
    """
    plugins = {name: one for name, one in installed.items() if one.is_plugin and name != "benchbot"}
    known = {**plugins, **dict.fromkeys(v2_addons.installed())}
    wanted, newest, notes = list[str](), set[str](), list[str]()
    for name in names or known:
        key = name if name in known else normal(name)
        if key == "benchbot":
            raise BenchbotError(
                "BenchBot does not upgrade itself.",
                "It would have to change what is running.",
                "Do it with what has installed it: pip install --upgrade benchbot, or uv pip install -U benchbot",
            )
        if key not in known:
            raise BenchbotError(
                f"{name} is not installed.",
                f"Installed: {', '.join(sorted(known)) or 'none'}.{did_you_mean(name, list(known))}",
                f"Install it: benchbot install {name}",
            )
        source = _source(key, plugins.get(key))
        if source is None:
            notes.append(f"{key} stays: it came from a file or folder. Install it from there again.")
        else:
            wanted.append(source)
        if source == key and key in plugins:
            newest.add(key)
    return wanted, frozenset(newest), notes


def _source(name: str, plugin: Distribution | None) -> str | None:
    if plugin is None:
        origin = addons.origin_of(name)
        return origin if "://" in origin else None
    if plugin.origin is None:
        return name
    vcs = plugin.origin.get("vcs_info")
    if vcs is None:
        return None
    revision = vcs.get("requested_revision")
    return f"git+{plugin.origin['url']}{f'@{revision}' if revision else ''}"
