"""`benchbot challenge`: the organiser's commands, and the participant's."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import QUICK, Json
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.plugins.challenge.database import Database
    from benchbot.plugins.challenge.document import Challenge
    from benchbot.plugins.challenge.signing import Key

app = typer.Typer(
    help="Run a challenge, or take part in one: submissions, queue, hidden places, leaderboard.",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings=QUICK,
)

ORGANISER_TOKEN = "organiser.token"  # noqa: S105 - a file's name
DATABASE_VARIABLE = "BENCHBOT_CHALLENGE_DATABASE"
Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of the challenge.")]
Url = Annotated[str, typer.Argument(metavar="URL", help="The address of the challenge.")]
Identifier = Annotated[str, typer.Argument(metavar="ID", help="The submission.")]
Why = Annotated[str, typer.Option("--why", metavar="TEXT", help="The reason, which stays visible.")]
DatabaseUrl = Annotated[
    str | None,
    typer.Option(
        "--database",
        metavar="URL",
        envvar=DATABASE_VARIABLE,
        show_envvar=False,
        help="Its database, e.g. postgresql://USER@HOST/NAME. [default: challenge.db in the folder]",
    ),
]
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


@app.command()
def init(
    folder: Folder,
    title: Annotated[str, typer.Option(metavar="TEXT", help="What people call it.")] = "",
) -> None:
    """Make a challenge that runs at once, in a new folder: declaration, rules, secrets, key. Edit it as you like."""
    require_extra()
    from benchbot.plugins.challenge import starting

    made = starting.make(folder, title or folder.resolve().name.replace("_", " ").replace("-", " ").capitalize())
    console.note(
        f"Made a challenge in {folder}. When you have edited its declaration: benchbot check {folder}/challenge.yaml"
    )
    console.note("Publish these sums now; they bind you to what is drawn from the secrets:")
    console.data(*(f"{value}  {name}" for name, value in made.commitments().items()))
    console.note(f"Start it: benchbot challenge serve {folder}")


@app.command()
def serve(
    folder: Folder,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="The address to listen at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(metavar="PORT", min=0, max=65535, help="The port to listen at.")] = 8090,
    workers: Annotated[
        int, typer.Option(metavar="N", min=0, help="So many workers compute submissions on this machine.")
    ] = 1,
    database: DatabaseUrl = None,
    public_url: Annotated[
        str | None, typer.Option("--public-url", metavar="URL", help="The address that people use, behind a proxy.")
    ] = None,
) -> None:
    """Serve the challenge to browsers and programs, and compute what is handed in, until Ctrl-C."""
    require_extra()
    from benchbot.plugins.challenge import serving

    serving.serve(folder, host, port, workers, database, public_url)


@app.command()
def worker(
    folder: Folder,
    database: DatabaseUrl = None,
    until_empty: Annotated[bool, typer.Option("--until-empty", help="End when nothing waits.")] = False,
    parent: Annotated[int | None, typer.Option("--parent", hidden=True)] = None,
) -> None:
    """Compute submissions, beside others; the folder must be on a disk that all of them share."""
    require_extra()
    from benchbot.plugins.challenge import serving

    serving.work(folder, database, until_empty=until_empty, parent=parent)


@app.command()
def invite(
    folder: Folder,
    count: Annotated[int, typer.Argument(metavar="[N]", min=1, max=1000, help="How many.")] = 1,
    note: Annotated[str, typer.Option(metavar="TEXT", help="For whom, in the log.")] = "",
    database: DatabaseUrl = None,
) -> None:
    """Print new invitations, each good for one team."""
    require_extra()
    from benchbot.plugins.challenge import people

    _, opened = _opened(folder, database)
    console.data(*(people.invite(opened, note) for _ in range(count)))


@app.command("teams")
def list_teams(folder: Folder, database: DatabaseUrl = None) -> None:
    """List the teams, with what they have running."""
    require_extra()
    from benchbot.plugins.challenge import people

    rows = [row for row in people.all_teams(_opened(folder, database)[1]) if not row.baseline]
    console.table(
        ("team", "signs", "running", "blocked"),
        [(row.name, "yes" if row.key else "no", str(row.running), row.blocked or "") for row in rows],
    )


@app.command()
def renew(
    folder: Folder,
    team: Annotated[str, typer.Argument(metavar="TEAM", help="The team's name.")],
    database: DatabaseUrl = None,
) -> None:
    """Print a new token for a team that has lost its own, which ends."""
    require_extra()
    from benchbot.plugins.challenge import people

    console.data(people.renew_token(_opened(folder, database)[1], team))


@app.command()
def pause(folder: Folder, why: Why, database: DatabaseUrl = None) -> None:
    """Let no worker begin anything more; what runs goes on."""
    require_extra()
    from benchbot.plugins.challenge import organiser

    organiser.pause(_opened(folder, database)[1], why)


@app.command()
def resume(folder: Folder, database: DatabaseUrl = None) -> None:
    """Let workers begin again after a pause."""
    require_extra()
    from benchbot.plugins.challenge import organiser

    organiser.pause(_opened(folder, database)[1], None)


@app.command()
def requeue(folder: Folder, identifier: Identifier, why: Why, database: DatabaseUrl = None) -> None:
    """Compute a submission anew, from nothing."""
    require_extra()
    from benchbot.plugins.challenge import organiser, starting

    challenge, opened = _opened(folder, database)
    organiser.requeue(opened, identifier, why)
    starting.discard_work(challenge, identifier)


@app.command()
def disqualify(folder: Folder, identifier: Identifier, why: Why, database: DatabaseUrl = None) -> None:
    """Take a submission off the leaderboard; the reason is shown there."""
    require_extra()
    from benchbot.plugins.challenge import organiser

    organiser.disqualify(_opened(folder, database)[1], identifier, why)


@app.command()
def log(
    folder: Folder,
    most: Annotated[int, typer.Option("--last", metavar="N", min=1, help="The last N.")] = 50,
    database: DatabaseUrl = None,
) -> None:
    """Print who did what, the newest first."""
    require_extra()
    from datetime import UTC, datetime

    from benchbot.plugins.challenge import organiser
    from benchbot.plugins.challenge.document import written

    console.table(
        ("when", "who", "did", "submission", "detail"),
        [
            (written(datetime.fromtimestamp(row.at, UTC)), row.actor, row.action, row.submission or "", row.detail)
            for row in organiser.log(_opened(folder, database)[1], most)
        ],
    )


@app.command()
def publish(
    folder: Folder,
    target: Annotated[Path, typer.Argument(metavar="TARGET", help="A new folder for the static site.")],
    reveal: Annotated[bool, typer.Option("--reveal", help="Secrets and places as well, once it is over.")] = False,
    database: DatabaseUrl = None,
) -> None:
    """Write the leaderboards as a static site for any web server, with all that is needed to verify them."""
    require_extra()
    from benchbot.plugins.challenge import publication, serving

    site = serving.site(*_opened(folder, database))
    written = publication.write(site, target, reveal=reveal)
    console.note(f"Wrote {len(written)} files. Whoever likes may check them:")
    console.data(f"benchbot challenge verify {target} --key {site.key.public['keyid']}")


@app.command()
def backup(
    folder: Folder,
    target: Annotated[Path, typer.Argument(metavar="FILE", help="A new file; it holds the secrets.")],
    database: DatabaseUrl = None,
) -> None:
    """Write the whole challenge into one file; it may be served meanwhile."""
    require_extra()
    from benchbot.plugins.challenge import backup as backups

    challenge, opened = _opened(folder, database)
    backups.write(challenge.folder, opened, target)


@app.command()
def restore(
    source: Annotated[Path, typer.Argument(metavar="FILE", help="What backup has written.")],
    folder: Folder,
    database: DatabaseUrl = None,
) -> None:
    """Make a challenge of its backup, in a new folder."""
    require_extra()
    from benchbot.plugins.challenge import backup as backups

    backups.restore(source, folder, database)


@app.command()
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


@app.command()
def pack(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER|FILE", help="The solution.")],
    target: Annotated[Path, typer.Argument(metavar="ARCHIVE.zip", help="The file to write.")],
    command: Command = None,
) -> None:
    """Write a solution as an archive, to be handed in by a browser."""
    from benchbot.plugins.challenge import intake

    console.check_output(target)
    intake.pack(folder, command, target)
    console.data(str(target))


@app.command()
def submit(
    url: Url,
    what: Annotated[
        str | None,
        typer.Argument(metavar="[FOLDER|FILE|BUNDLE]", help="The solution: with --command, a Dockerfile, or a bundle."),
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

    signer = _signer(key)
    server = client.Server(url, client.known_token(url, token_file))
    chosen = phase or next(iter(server.ask("GET", "/api/v1/challenge")["phases"]))
    with handing_in.archive(what, command, example) as archive:
        made = client.submit(server, archive, chosen, title or example or "", signer)
    console.note(f"Handed in to {chosen}; SHA-256 {made['sha256']}.")
    if wait:
        made = handing_in.wait(server, made)
    _show(made, as_json=as_json)


@app.command()
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


@app.command()
def withdraw(url: Url, identifier: Identifier, token_file: TokenFile = None) -> None:
    """Take a submission back that has not begun; it counts for no quota."""
    from benchbot.plugins.challenge import client

    client.Server(url, client.known_token(url, token_file)).ask("DELETE", f"/api/v1/submissions/{identifier}")


@app.command()
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


@app.command()
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


def _opened(folder: Path, database: str | None) -> "tuple[Challenge, Database]":
    from benchbot.plugins.challenge.database import Database, url_of
    from benchbot.plugins.challenge.document import read

    challenge = read(folder)
    return challenge, Database(url_of(challenge, database))


def _show(submission: dict[str, Any], *, as_json: bool) -> None:
    if as_json:
        console.data_json(submission)
        return
    console.data(submission["id"])
    said = f"{submission['state']}{': ' + submission['reason'] if submission['reason'] else ''}"
    console.note(f"It is {said}{'' if submission['score'] is None else f', with {_score(submission)}'}.")


def _score(row: dict[str, Any]) -> str:
    return "" if row["score"] is None else f"{row['score']:.4f}"
