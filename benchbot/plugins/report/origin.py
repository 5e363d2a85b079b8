"""Where results came from: versions, hashes, seeds, revisions; and how long and far the robot drove."""

from dataclasses import dataclass

from benchbot.plugins.drawing.driven import ways
from benchbot.plugins.drawing.episodes import Document, Episode, Material


@dataclass(frozen=True)
class Drive:
    """What an episode took, as far as its result says: steps, simulated seconds, metres, collisions."""

    episode: Episode
    steps: int | None
    simulated_time_s: float | None
    path_length_m: float | None
    collisions: int | None


@dataclass(frozen=True)
class Distribution:
    """A plug-in in one version, and the SHA-256 of its files."""

    name: str
    version: str
    sha256: str


def drives(material: Material) -> list[Drive]:
    """Return what each episode took, of those whose results say so."""
    found = []
    for episode in material.episodes:
        steps, time_s = (episode.provenance.get(key) for key in ("steps", "simulated_time_s"))
        recorded = [way for way in ways(episode) if way.recorded]
        lengths = [way.path_length_m for way in recorded if way.path_length_m is not None]
        collisions = [way.collisions for way in recorded if way.collisions is not None]
        if steps is not None or recorded:
            total_m = sum(lengths) if lengths else None
            found.append(Drive(episode, steps, time_s, total_m, sum(collisions) if collisions else None))
    return found


def distributions(material: Material) -> list[Distribution]:
    """Return every distribution in every version that the results were made with."""
    found = {
        Distribution(str(name), str(plugin.get("version", "")), str(plugin.get("sha256", "")))
        for episode in material.episodes
        for name, plugin in (episode.provenance.get("plugins") or {}).items()
    }
    return sorted(found, key=lambda item: (item.name, item.version, item.sha256))


def mixed(found: list[Distribution]) -> list[str]:
    """Return the distributions that are there in more than one version, so that results are hard to compare."""
    names = [item.name for item in found]
    return sorted({name for name in names if names.count(name) > 1})


def command(episode: Episode) -> str:
    """Return what ran as the solution."""
    return " ".join(map(str, _solution(episode).get("command", ())))


def revision(episode: Episode) -> str:
    """Return the solution's git revision, and whether there were changes beside it."""
    found = _solution(episode).get("git_revision")
    return "" if found is None else f"{found}{' with changes' if _solution(episode).get('git_dirty') else ''}"


def _solution(episode: Episode) -> Document:
    return episode.provenance.get("solution") or {}
