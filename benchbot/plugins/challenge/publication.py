"""Publishing: a static site of the leaderboards with all that is needed to verify them, and that verification.

index.html, PHASE.html, style.css    for people
challenge.json                       name, phases, key, commitments
PHASE.json, PHASE.csv                the leaderboard
PHASE-history.html, .json            how it came about
PHASE-rows.json                      every scored and disqualified submission, its statements signed
pictures/                            of what was found, in places that everybody may see
keys.json                            the public key of each team that signs
places.secret, runs.secret, ...      once they are revealed
"""

import csv
import hashlib
import io
import json
import shutil
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from sqlalchemy import or_, select

from benchbot.core import atomic, plugin_manager, results
from benchbot.core.errors import BenchbotError
from benchbot.plugins.challenge import leaderboard, people, signing
from benchbot.plugins.challenge.document import DISQUALIFIED, PLACES_SECRET, RUNS_SECRET, SCORED
from benchbot.plugins.challenge.tables import scores, submissions, teams
from benchbot.plugins.challenge.web import api, pages
from benchbot.plugins.challenge.web.site import Caller, Site

CHALLENGE, KEYS = "challenge.json", "keys.json"
Document = dict[str, Any]


def write(site: Site, target: Path, *, reveal: bool = False) -> list[Path]:
    """Write the static site into a new folder; with `reveal` secrets and places, too, once the challenge is over.

    Returns the files. Raises BenchbotError where there is something already, and for secrets of a phase that is open.
    """
    if target.exists() and any(target.iterdir()):
        raise BenchbotError(f"{target} is not empty.", "A static site is written whole.", "Name a new folder.")
    if reveal:
        _require_over(site)
    files: dict[str, bytes] = {
        CHALLENGE: _json(api.description(site)),
        KEYS: _json({team.name: team.key for team in people.all_teams(site.database) if team.key is not None}),
        "style.css": (pages.TEMPLATES.parent / "static" / "style.css").read_bytes(),
        "index.html": _page(site, "index.html", rules=pages.rules_html(site.challenge.rules)),
    }
    for name, phase in site.challenge.phases.items():
        board = site.board(name)
        files[f"{name}.html"] = pages.board_page(site, phase, caller=Caller(), path="", static=True)
        past = pages.history_page(site, phase, None, caller=Caller(), path="", static=True)
        files[f"{name}-history.html"] = past
        files[f"{name}-history.json"] = _json([asdict(step) for step in site.history(name)])
        files[f"{name}.json"] = _json(asdict(board))
        files[f"{name}.csv"] = _csv(board)
        files[f"{name}-rows.json"] = _json(_rows(site, name))
        shown = {item["file"] for row in board.standings for item in row.pictures}
        files |= {f"pictures/{file}": (site.challenge.pictures / file).read_bytes() for file in sorted(shown)}
    for name, content in files.items():
        atomic.write(target / name, content)
    written = [target / name for name in files]
    if reveal:
        written += _reveal(site, target)
    return written


def verify(folder: Path, key_id: str | None) -> Document:
    """Check an export from its files alone, and return `{key, phases: {name: rows}, commitments}`.

    Every submission is signed by its team (or by the organiser on its behalf), every score by the organiser's key
    about that very submission; no statement counts twice; the leaderboard follows from them; revealed files have the
    sums that were published. `key_id` is the key that was published at the start: without it, whoever has made the
    export could have signed all of it anew. Raises BenchbotError for the first thing that is wrong.
    """
    try:
        return _verified(folder, key_id)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _false("The export has not the form of one.", f"{type(error).__name__}: {error}") from error


@dataclass(frozen=True)
class Place:
    """Where scores of one's own would stand on a published leaderboard, beside whom."""

    rank: int
    team: str
    score: float
    interval: tuple[float, float] | None
    is_own: bool
    is_tied: bool
    """Whether the test over places does not tell it from one's own."""


def compared(folder: Path, phase: str, path: Path) -> list[Place]:
    """Return the leaderboard of an export with a scores document of one's own among its rows (`benchbot eval`).

    Raises BenchbotError for scores of another method, of other places, or of a phase whose places are hidden.
    """
    described, board, document = _read(folder / CHALLENGE), _read(folder / f"{phase}.json"), results.read_scores(path)
    rules, method = described["phases"][phase], document["method"]
    if rules["hidden"]:
        raise _not_comparable(f"The places of {rules['title']} are hidden.", "Your own results are of other ones.")
    if method["name"] != rules["method"]:
        raise _not_comparable(f"{path} was scored by another method.", f"{method['name']}, not {rules['method']}.")
    own = leaderboard.by_environment(document, plugin_manager.load().record("evaluators", method["name"]))
    if set(own) != set(rules["environments"]):
        wanted = ", ".join(rules["environments"])
        raise _not_comparable(f"{path} is of other places.", f"{', '.join(sorted(own))}, not {wanted}.")
    interval = (document.get("intervals") or {}).get(board["score_name"])
    score = float(document["scores"][board["score_name"]])
    places = [
        Place(0, row["team"], row["score"], row["interval"], is_own=False, is_tied=_is_tied(own, row["by_environment"]))
        for row in board["standings"]
    ]
    places.append(Place(0, "(yours)", score, interval and (interval["low"], interval["high"]), True, True))
    sign = 1 if board["lower_is_better"] else -1
    places.sort(key=lambda place: (sign * place.score, place.is_own))
    return [replace(place, rank=rank) for rank, place in enumerate(places, 1)]


def _is_tied(own: Mapping[str, float], other: Mapping[str, float]) -> bool:
    return not leaderboard.is_more_than_luck([own[name] - other[name] for name in sorted(own) if name in other])


def _not_comparable(title: str, why: str) -> BenchbotError:
    return BenchbotError(title, why, "Run the task of the phase in its places, and score it by its method.")


def _verified(folder: Path, key_id: str | None) -> Document:
    described, keys = _read(folder / CHALLENGE), _read(folder / KEYS)
    key = signing.public_key(described["key"])
    if key_id is not None and key.keyid != key_id:
        raise _false("It is signed with another key than the one that was published.", f"Its key is {key.keyid}.")
    known = {name: signing.public_key(value) for name, value in keys.items()}
    counted = {}
    seen: set[str] = set()
    for name, phase in described["phases"].items():
        rows = _read(folder / f"{name}-rows.json")
        for row in rows:
            _check_row(row, described["name"], name, phase, key, known, seen)
        board = _read(folder / f"{name}.json")
        _check_board(board, rows, phase)
        _check_pictures(folder, board, {row["id"]: row for row in rows}, key)
        counted[name] = len(rows)
    revealed = {}
    for name, sum_published in described["commitments"].items():
        path = folder / name
        if path.is_file():
            if hashlib.sha256(path.read_bytes()).hexdigest() != sum_published:
                raise _false(f"{name} is not what was committed to.", f"Its sum is not {sum_published}.")
            revealed[name] = sum_published
    return {"key": key.keyid, "phases": counted, "commitments": described["commitments"], "revealed": revealed}


def _check_row(
    row: Mapping[str, Any],
    challenge: str,
    phase: str,
    rules: Mapping[str, Any],
    key: Any,
    known: Mapping[str, Any],
    seen: set[str],
) -> None:
    about = f"Submission {row['id']} of {row['team']}"
    signer = key if row["envelope_by"] == "organiser" else known.get(row["team"])
    if signer is None or (row["envelope_by"] == "organiser") != (row["team"] not in known):
        raise _false(f"{about} is not signed by its team.", "Its key is not there.")
    handed_in = signing.opened(row["envelope"], signer, signing.SUBMISSION)
    about_it = signing.about(challenge, phase, row["team"], handed_in.predicate.get("image"))
    if handed_in.sha256 != row["sha256"] or not signing.is_about(handed_in.predicate, about_it):
        raise _false(f"{about} is about something else.", "Its signed statement names other things than its row.")
    if handed_in.digest in seen:
        raise _false(f"{about} counts twice.", "Another row has the same signed statement.")
    seen.add(handed_in.digest)
    if row["state"] == DISQUALIFIED:
        return
    judged = signing.opened(row["score_envelope"], key, signing.SCORE)
    stated = judged.predicate
    committed = stated.get("commitments") or {}
    expected = {**about_it, "submission": row["id"], "statement": handed_in.digest, "score": row["score"]}
    if judged.sha256 != row["sha256"] or not signing.is_about(stated, expected):
        raise _false(
            f"The score of {about[0].lower()}{about[1:]} is another one.", "It is not the one that was signed."
        )
    if rules["hidden"] and not committed:
        raise _false(f"{about} was scored in places that nobody is bound to.", "Its statement names no commitment.")


def _check_board(board: Mapping[str, Any], rows: list[Mapping[str, Any]], rules: Mapping[str, Any]) -> None:
    """Check that a leaderboard has each team's submission that counts, in the order of the signed scores."""
    better: dict[str, Mapping[str, Any]] = {}
    sign = 1 if board["lower_is_better"] else -1
    for row in sorted((row for row in rows if row["state"] == SCORED), key=lambda row: row["number"]):
        known = better.get(row["team"])
        if known is None or rules["counts"] == "last" or sign * row["score"] < sign * known["score"]:
            better[row["team"]] = row
    expected = [row["id"] for row in sorted(better.values(), key=lambda row: (sign * row["score"], row["number"]))]
    if [standing["submission"] for standing in board["standings"]] != expected:
        raise _false(
            "The leaderboard is not that of the signed scores.", f"Phase {board['phase']} is ranked otherwise."
        )


def _check_pictures(folder: Path, board: Mapping[str, Any], rows: Mapping[str, Mapping[str, Any]], key: Any) -> None:
    """Check that the pictures beside a row are those that its signed statement names, by their sums."""
    for standing in board["standings"]:
        names = [item["file"] for item in standing["pictures"]]
        envelope = rows[standing["submission"]]["score_envelope"]
        signed = signing.opened(envelope, key, signing.SCORE).predicate.get("pictures", ()) if names else ()
        for name in names:
            path = folder / "pictures" / Path(name).name
            content = path.read_bytes() if path.is_file() else b""
            if name not in signed or hashlib.sha256(content).hexdigest() != path.stem:
                raise _false(f"A picture of {standing['team']} is not the one that was signed.", f"It is {path.name}.")


def _rows(site: Site, phase: str) -> list[Document]:
    told_until = site.challenge.phases[phase].told_until(site.database.clock())
    chosen = (
        select(submissions, teams.c.name.label("team_name"), scores.c.score, scores.c.envelope.label("score_envelope"))
        .join(teams, teams.c.id == submissions.c.team)
        .join(scores, scores.c.submission == submissions.c.id, isouter=True)
        .where(submissions.c.phase == phase, submissions.c.state.in_((SCORED, DISQUALIFIED)))
        .where(or_(submissions.c.state == DISQUALIFIED, submissions.c.ended_at <= told_until))
        .order_by(submissions.c.number)
    )
    with site.database.reading() as connection:
        return [
            {
                **{name: getattr(row, name) for name in ("id", "number", "sha256", "state", "reason", "envelope")},
                "team": row.team_name,
                "envelope_by": "organiser" if site.key.has_signed(row.envelope) else "team",
                "score": row.score,
                "score_envelope": row.score_envelope,
            }
            for row in connection.execute(chosen)
        ]


def _page(site: Site, name: str, **values: Any) -> bytes:
    """Return a page of a folder of files: its links are relative, and nobody is there to enter."""
    text = pages.page(site, name, caller=Caller(), path="", static=True, **values).body
    return bytes(text)


def _csv(board: leaderboard.Board) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["rank", "group", "team", "baseline", "submission", board.score_name, "low", "high", "scored"])
    for row in board.standings:
        low, high = row.interval or ("", "")
        team = f"'{row.team}" if row.team[:1] in "=+-@" else row.team  # a spreadsheet would compute it
        writer.writerow([row.rank, row.group, team, row.is_baseline, row.submission, row.score, low, high, row.entries])
    return text.getvalue().encode()


def _require_over(site: Site) -> None:
    from datetime import UTC, datetime

    now = datetime.fromtimestamp(site.database.clock(), UTC)
    for phase in site.challenge.phases.values():
        if phase.hidden and (phase.closes is None or now < phase.closes):
            raise BenchbotError(
                f"The secrets of {phase.title} cannot be revealed yet.",
                "The phase is hidden, and may still be submitted to.",
                f"Give it an end in the past ('closes') in {site.challenge.folder}/challenge.yaml first.",
            )


def _reveal(site: Site, target: Path) -> list[Path]:
    written = []
    for name in (PLACES_SECRET, RUNS_SECRET):
        if (site.challenge.folder / name).is_file():
            written.append(Path(shutil.copy(site.challenge.folder / name, target / name)))
            written[-1].chmod(0o644)
    for phase in site.challenge.phases.values():
        for addon in phase.addons if phase.hidden else ():
            shutil.copytree(site.challenge.folder / addon, target / "places" / Path(addon).name, dirs_exist_ok=True)
            written.append(target / "places" / Path(addon).name)
            origin = (site.challenge.folder / addon).with_suffix(".origin.json")
            if origin.is_file():  # what they were drawn from, besides the secret
                written.append(Path(shutil.copy(origin, target / "places" / origin.name)))
    return written


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise BenchbotError(
            f"{path.parent} is no export of a challenge.", f"{path.name}: {error}", "Name what 'publish' has written."
        ) from error


def _json(document: Any) -> bytes:
    return (json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n").encode()


def _false(title: str, why: str) -> BenchbotError:
    return BenchbotError(title, why, "Trust nothing of this export; ask who has published it.")
