"""The challenge as its organiser declares it: `challenge.yaml`, and the folder around it."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError, did_you_mean

FILE = "challenge.yaml"
PLACES_SECRET, RUNS_SECRET, SIGNING_KEY = "places.secret", "runs.secret", "challenge.key"
MODES = ("sandbox", "container")
QUEUED, RUNNING, SCORED, FAILED = "queued", "running", "scored", "failed"
WITHDRAWN, DISQUALIFIED = "withdrawn", "disqualified"
"""The states of a submission. One that was withdrawn before it ran counts for no quota."""
FORBIDDEN = (
    *("native", "sandbox", "sandboxed", "example", "example_containerised", "containerised", "solutions", "args"),
    *("source", "readable", "v2_client", "weak_limits", "secret", "prefix", "zip", "name", "description"),
    *("repeats", "rerun_collided"),
)
"""Keys of a batch file that no phase may fix: they say what the solution is, or have something count twice."""
TOLD_EVERY_S = 600
"""So often the results of a hidden phase are told, unless it says otherwise."""
_UNITS = {"B": 1, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30}


@dataclass(frozen=True)
class Phase:
    """One phase: when it is open (UTC; None: always), what is computed, how often a team may submit, what counts."""

    name: str
    title: str
    batch: Mapping[str, Any]
    opens: datetime | None = None
    closes: datetime | None = None
    addons: tuple[str, ...] = ()
    hidden: bool = False
    per_day: int | None = None
    in_all: int | None = None
    modes: tuple[str, ...] = MODES
    modes_are_named: bool = False
    """Whether the declaration promises these modes; else those are admitted that the server can compute."""
    counts: str = "best"
    told_every_s: int = 0
    """Results are told at full multiples of it alone (UTC), so that the length of a run tells nothing; 0: at once."""

    def told_until(self, now: float) -> float:
        """Return the moment up to which results are told at a time; both in seconds since the epoch."""
        return now - now % self.told_every_s if self.told_every_s else now

    def told_at(self, ended_at: float) -> float:
        """Return the moment at which a result is told that was there at another; both in seconds since the epoch."""
        return self.told_until(ended_at) + self.told_every_s

    @property
    def method(self) -> str:
        """The name of the evaluation method."""
        return str(self.batch["evaluate_with"])

    def closed_because(self, now: datetime) -> str | None:
        """Return why nothing may be submitted at a time, None where something may."""
        if self.opens is not None and now < self.opens:
            return f"It opens at {written(self.opens)}."
        if self.closes is not None and now >= self.closes:
            return f"It closed at {written(self.closes)}."
        return None


@dataclass(frozen=True)
class Challenge:
    """A challenge and its folder, which holds uploads, secrets, places and the work of its queue."""

    folder: Path
    name: str
    title: str
    phases: Mapping[str, Phase]
    organiser: str = ""
    rules: str = ""
    """Markdown."""
    most_teams: int | None = None
    signed: bool = False
    largest_bytes: int = 2**28
    uploads_at_once: int = 2
    kept_bytes: int = 2**33
    unpacked_bytes: int = 2**33
    baselines: tuple[Mapping[str, str], ...] = field(default=())

    def phase(self, name: str) -> Phase:
        """Return a phase by name; raises BenchbotError for one that is not there."""
        if name not in self.phases:
            raise BenchbotError(
                f"'{name[:60]}' is no phase of {self.title}.",
                f"Its phases: {', '.join(self.phases)}.{did_you_mean(name, list(self.phases))}",
                "Name one of these with --phase.",
            )
        return self.phases[name]

    @property
    def uploads(self) -> Path:
        """The folder of what was handed in, one file for each submission."""
        return self.folder / "uploads"

    @property
    def work(self) -> Path:
        """The folder of what workers compute, one folder for each submission."""
        return self.folder / "work"

    @property
    def pictures(self) -> Path:
        """The folder of pictures of what was found, by the sums of their bytes."""
        return self.folder / "pictures"

    @property
    def hidden_places(self) -> frozenset[str]:
        """The places of all hidden phases, whichever of their variants those have."""
        hidden = [phase.batch["environments"] for phase in self.phases.values() if phase.hidden]
        return frozenset(place_of(name) for environments in hidden for name in environments)

    def commitments(self) -> dict[str, str]:
        """Return the SHA-256 of each secret by its file's name: what is published at the start, as `sha256sum` says."""
        return {
            name: hashlib.sha256((self.folder / name).read_bytes()).hexdigest()
            for name in (PLACES_SECRET, RUNS_SECRET)
            if (self.folder / name).is_file()
        }


def place_of(environment: str) -> str:
    """Return the place of an environment: its name without variants."""
    return environment.partition(":")[0]


def read(folder: Path) -> Challenge:
    """Return the challenge in a folder; raises BenchbotError when there is none, or it is not as its schema says."""
    path = folder / FILE
    if not path.is_file():
        raise BenchbotError(
            f"There is no challenge in {folder}.",
            f"It has no {FILE}.",
            f"Name the folder of one, or make one: benchbot challenge init {folder}",
        )
    document = schema.read(path)
    schema.check(document, "challenge", path)
    teams, uploads = document.get("teams", {}), document.get("uploads", {})
    phases = {name: _phase(name, given, path) for name, given in document["phases"].items()}
    found = Challenge(
        folder=folder.resolve(),
        name=document["name"],
        title=document["title"],
        phases=phases,
        organiser=document.get("organiser", ""),
        rules=_rules(path, document.get("rules")),
        most_teams=teams.get("most"),
        signed=teams.get("signed", False),
        largest_bytes=_bytes(uploads.get("largest", "256MiB")),
        uploads_at_once=uploads.get("at_once", 2),
        kept_bytes=_bytes(uploads.get("kept", "8GiB")),
        unpacked_bytes=_bytes(uploads.get("unpacked", "8GiB")),
        baselines=tuple(document.get("baselines", ())),
    )
    missing = [name for name in (PLACES_SECRET, RUNS_SECRET) if not (folder / name).is_file()]
    if missing and any(phase.hidden for phase in phases.values()):
        raise BenchbotError(
            f"The secrets of {found.title} are not there.",
            f"A phase is hidden, and {folder} lacks: {', '.join(missing)}.",
            "Bring them back from your backup. For a new challenge: benchbot challenge init FOLDER",
        )
    return found


def written(moment: datetime) -> str:
    """Return a moment as people read it, in UTC."""
    return moment.astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC")


def _phase(name: str, given: Mapping[str, Any], path: Path) -> Phase:
    batch = dict(given["batch"])
    foreign = [key for key in FORBIDDEN if key in batch]
    if foreign:
        raise BenchbotError(
            f"{path} fixes what is not the organiser's to fix.",
            f"The batch of phase '{name}' has: {', '.join(foreign)}. Solutions are the teams', secrets this folder's.",
            "Leave them out.",
        )
    schema.check({"name": name, **batch}, "batch", path)
    quota = given.get("quota", {})
    opens, closes = (_moment(given.get(key), key, path) for key in ("opens", "closes"))
    if opens is not None and closes is not None and closes <= opens:
        raise BenchbotError(
            f"Phase '{name}' of {path} closes before it opens.",
            f"It opens at {written(opens)} and closes at {written(closes)}.",
            "Mend the dates.",
        )
    # A restart teaches the place in attempts that do not count.
    return Phase(
        name=name,
        title=given.get("title", name.capitalize()),
        batch={**batch, "limits": {"restarts": 0, **batch.get("limits", {})}},
        opens=opens,
        closes=closes,
        addons=tuple(given.get("addons", ())),
        hidden=given.get("hidden", False),
        per_day=quota.get("per_day"),
        in_all=quota.get("in_all"),
        modes=tuple(given.get("modes", MODES)),
        modes_are_named="modes" in given,
        counts=given.get("counts", "best"),
        told_every_s=given.get("told_every_s", TOLD_EVERY_S if given.get("hidden", False) else 0),
    )


def _moment(text: str | None, key: str, path: Path) -> datetime | None:
    if text is None:
        return None
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        moment = None
    if moment is None or moment.tzinfo is None:
        raise BenchbotError(
            f"{path} has a date that means no moment.",
            f"'{key}' is {text!r:.60}; a date, a time and an offset are needed.",
            "Write it such as: 2027-03-01T00:00:00Z",
        )
    return moment


def _rules(path: Path, name: str | None) -> str:
    if name is None:
        return ""
    try:
        return (path.parent / name).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BenchbotError(
            f"The rules of {path} cannot be read.", f"{name}: {error}", "Name a Markdown file beside it."
        ) from error


def _bytes(text: str) -> int:
    number, unit = re.fullmatch(r"(\d+) ?(\w+)", text).groups()  # type: ignore[union-attr]  # the schema holds it
    return int(number) * _UNITS[unit]
