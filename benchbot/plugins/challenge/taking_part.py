"""The participant's commands of `benchbot challenge`: joining, handing in, and checking what was published."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.plugins.challenge.signing import Key

Url = Annotated[str, typer.Argument(metavar="URL", help="The address of the challenge.")]
Identifier = Annotated[str, typer.Argument(metavar="ID", help="The submission.")]
TokenFile = Annotated[
    Path | None,
    typer.Option(
        "--token-file",
        metavar="FILE",
        help="A file with your team's token. [default: $BENCHBOT_CHALLENGE_TOKEN, or as you joined]",
    ),
]
KeyFile = Annotated[
    Path | None, typer.Option("--key", metavar="FILE", help="Sign with this key (benchbot key make FILE).")
]
Command = Annotated[
    str | None, typer.Option("--command", metavar="WORDS", help="Runs the solution in its folder, in a sandbox.")
]


def join(
    url: Url,
    invitation: Annotated[str, typer.Argument(metavar="INVITATION", help="As the organiser has sent it.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Your team's name.")],
    key: KeyFile = None,
) -> None:
    """Join a challenge as a new team; its token is kept for the other commands."""
    from benchbot.plugins.challenge import client

    path = client.join(url, invitation, name, _signer(key))
    console.note(f"Joined. Your team's token is in {path}, readable for you alone.")


def pack(
    what: Annotated[str, typer.Argument(metavar="FOLDER|FILE|IMAGE", help="The solution.")],
    target: Annotated[Path, typer.Argument(metavar="ARCHIVE.zip", help="The file to write.")],
    command: Command = None,
) -> None:
    """Write a solution as an archive, to be handed in by a browser."""
    from benchbot.plugins.challenge import handing_in

    console.check_output(target)
    handing_in.pack(what, command, target)
    console.data(str(target))


def submit(
    url: Url,
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="[FOLDER|FILE|IMAGE|BUNDLE]",
            help="The solution: with --command, with a Dockerfile, an image of podman or docker, or a bundle.",
        ),
    ] = None,
    command: Command = None,
    example: Annotated[str | None, typer.Option(metavar="NAME", help="An example solution in its place.")] = None,
    phase: Annotated[str | None, typer.Option(metavar="PHASE", help="Which one. [default: the first]")] = None,
    title: Annotated[str, typer.Option(metavar="TEXT", help="What it is, as the leaderboard shows it.")] = "",
    key: KeyFile = None,
    token_file: TokenFile = None,
    wait: Annotated[bool, typer.Option("--wait", help="End only when it has been scored.")] = False,
    as_json: Json = False,
) -> None:
    """Hand in a solution; the submission's identifier goes to stdout."""
    from benchbot.plugins.challenge import client, handing_in
    from benchbot.plugins.challenge.document import MODES

    signer = _signer(key)
    server = client.Server(url, client.known_token(url, token_file))
    challenge = server.ask("GET", "/api/v1/challenge")
    chosen = phase or next(iter(challenge["phases"]))
    rules = challenge["phases"].get(chosen, {})
    admitted = handing_in.Admitted(rules.get("title", chosen), rules.get("modes", MODES), challenge["largest_bytes"])
    with handing_in.archive(what, command, example, admitted) as archive:
        made = client.submit(server, challenge, archive, chosen, title or example or "", signer)
    image = f", image {made['image']}" if made["image"] else ""
    console.note(f"Handed in to {chosen}; SHA-256 {made['sha256']}{image}.")
    if wait:
        made = handing_in.wait(server, made)
    _show(made, as_json=as_json)


def status(
    url: Url,
    identifier: Annotated[str | None, typer.Argument(metavar="[ID]", help="One submission.")] = None,
    token_file: TokenFile = None,
    as_json: Json = False,
) -> None:
    """Say what became of your submissions."""
    from benchbot.plugins.challenge import client

    server = client.Server(url, client.known_token(url, token_file))
    if identifier is not None:
        _show(server.ask("GET", f"/api/v1/submissions/{identifier}"), as_json=as_json)
        return
    rows = server.ask("GET", "/api/v1/submissions")
    if as_json:
        console.data_json(rows)
    else:
        console.table(
            ("submission", "phase", "title", "state", "score", "reason"),
            [(row["id"], row["phase"], row["title"], row["state"], _score(row), row["reason"]) for row in rows],
        )


def withdraw(url: Url, identifier: Identifier, token_file: TokenFile = None) -> None:
    """Take a submission back that has not begun; it counts for no quota."""
    from benchbot.plugins.challenge import client

    client.Server(url, client.known_token(url, token_file)).ask("DELETE", f"/api/v1/submissions/{identifier}")


def verify(
    export: Annotated[Path, typer.Argument(metavar="EXPORT", help="A folder that publish has written.")],
    key: Annotated[
        str | None, typer.Option("--key", metavar="ID", help="The organiser's key, as it was published at the start.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Check a published leaderboard: who handed in which bytes, what scored them, what the organiser was bound to."""
    require_extra()
    from benchbot.plugins.challenge import publication

    found = publication.verify(export, key)
    if as_json:
        console.data_json(found)
    else:
        rows = sum(found["phases"].values())
        console.data(f"All {rows} rows are signed as they must be, and the leaderboards follow from them.")
        for name in found["commitments"]:
            told = "is what was committed to" if name in found["revealed"] else "is not revealed yet"
            console.data(f"{name} {told}.")
    if key is None:
        console.note(
            f"The key was not named. Anybody could have signed all of this anew: compare {found['key']} with what was "
            "published when the challenge began, or name that with --key."
        )


def compare(
    export: Annotated[Path, typer.Argument(metavar="EXPORT", help="A folder that publish has written.")],
    scores: Annotated[Path, typer.Argument(metavar="SCORES", help="What benchbot eval has written of your results.")],
    phase: Annotated[str, typer.Option("--phase", metavar="PHASE", help="Which one.")] = "development",
    as_json: Json = False,
) -> None:
    """Say where results of your own would stand on a published leaderboard, without handing them in."""
    require_extra()
    from dataclasses import asdict

    from benchbot.plugins.challenge import publication

    places = publication.compared(export, phase, scores)
    if as_json:
        console.data_json([asdict(place) for place in places])
        return
    console.table(
        ("rank", "team", "score", "interval", "told apart from yours"),
        [
            (
                str(place.rank),
                place.team,
                f"{place.score:.4f}",
                "" if place.interval is None else "{:.4f} - {:.4f}".format(*place.interval),
                "" if place.is_own else "no" if place.is_tied else "yes",
            )
            for place in places
        ],
    )


def require_extra() -> None:
    """Raise BenchbotError where what an organiser, or whoever signs, needs besides is not installed."""
    from importlib.util import find_spec

    lacking = [name for name in ("alembic", "multipart", "securesystemslib", "sqlalchemy") if find_spec(name) is None]
    if lacking:
        raise BenchbotError(
            "Challenges and keys need more than is installed.",
            f"There is no {', '.join(lacking)}.",
            "Install it: pip install 'benchbot[challenge]'",
        )


def _signer(key: Path | None) -> "Key | None":
    if key is None:
        return None
    require_extra()
    from benchbot.plugins.challenge import signing

    return signing.load(key)


def _show(submission: dict[str, Any], *, as_json: bool) -> None:
    if as_json:
        console.data_json(submission)
        return
    console.data(submission["id"])
    said = f"{submission['state']}{': ' + submission['reason'] if submission['reason'] else ''}"
    console.note(f"It is {said}{'' if submission['score'] is None else f', with {_score(submission)}'}.")


def _score(row: dict[str, Any]) -> str:
    return "" if row["score"] is None else f"{row['score']:.4f}"
