"""`benchbot challenge`: the organiser's commands; the participant's are in `taking_part`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import QUICK
from benchbot.plugins.challenge import taking_part
from benchbot.plugins.challenge.taking_part import Identifier, require_extra

if TYPE_CHECKING:
    from benchbot.plugins.challenge.database import Database
    from benchbot.plugins.challenge.document import Challenge

app = typer.Typer(
    help="Run a challenge, or take part in one: submissions, queue, hidden places, leaderboard.",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings=QUICK,
)

DATABASE_VARIABLE = "BENCHBOT_CHALLENGE_DATABASE"
Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of the challenge.")]
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


for _command in (
    taking_part.join,
    taking_part.pack,
    taking_part.submit,
    taking_part.status,
    taking_part.withdraw,
    taking_part.verify,
    taking_part.compare,
):
    app.command()(_command)


def _opened(folder: Path, database: str | None) -> "tuple[Challenge, Database]":
    from benchbot.plugins.challenge.database import Database, url_of
    from benchbot.plugins.challenge.document import read

    challenge = read(folder)
    return challenge, Database(url_of(challenge, database))
