"""Serving a challenge: the web server, and workers as processes of their own, which are started anew when they die."""

import os
import shutil
import signal
import socket
import threading
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from subprocess import Popen

from sqlalchemy.exc import DBAPIError

from benchbot.cli.kit import console
from benchbot.core import plugin_manager
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.challenge import handing_in, intake, people, queue, signing, submissions
from benchbot.plugins.challenge import worker as workers
from benchbot.plugins.challenge.database import Database, url_of
from benchbot.plugins.challenge.document import SIGNING_KEY, Challenge, read
from benchbot.plugins.challenge.starting import ORGANISER_TOKEN
from benchbot.plugins.challenge.web import uploads
from benchbot.plugins.challenge.web.site import Site
from benchbot.process import start_module

RESTART_S = 2.0
SHUTDOWN_S = 5


def serve(
    folder: Path, host: str, port: int, worker_count: int, database_url: str | None, public_url: str | None
) -> None:
    """Serve a challenge until SIGINT or SIGTERM, with so many workers beside."""
    import uvicorn

    from benchbot.plugins.challenge.web.app import create_app

    challenge = read(folder)
    if worker_count:
        challenge = _proven(challenge)
    database = Database(url_of(challenge, database_url))
    served = site(challenge, database, public_url)
    uploads.sweep(served)
    _enter_baselines(served)
    with ExitStack() as stack:
        listener = stack.enter_context(_listening(host, port))
        where = public_url or f"http://{host}:{listener.getsockname()[1]}"
        console.note(f"{challenge.title} is served at {where}. Ctrl-C ends it.")
        console.note(f"Publish the identifier of its key: {served.key.public['keyid']}")
        if not any(not team.baseline for team in people.all_teams(database)):
            console.note("Nobody has joined yet. An invitation, for a first team:")
            console.note(f"  benchbot challenge join {where} {people.invite(database, 'the first')} NAME")
        console.note(f"Your own token for the queue's page is in {challenge.folder / ORGANISER_TOKEN}.")
        ended = threading.Event()
        keeper = threading.Thread(target=_keep_workers, args=(served, database_url, worker_count, ended))
        keeper.start()
        stack.callback(keeper.join)
        stack.callback(ended.set)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: None)  # uvicorn raises it once more when it has ended
        settings = {"log_config": None, "access_log": False, "server_header": False, "lifespan": "off"}
        config = uvicorn.Config(create_app(served), timeout_graceful_shutdown=SHUTDOWN_S, **settings)  # type: ignore[arg-type]
        uvicorn.Server(config).run([listener])


def work(folder: Path, database_url: str | None, *, until_empty: bool, parent: int | None = None) -> None:
    """Be one worker until SIGINT or SIGTERM, or until its parent has ended; another goes on with what it has begun."""
    challenge = read(folder)
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    database = Database(url_of(challenge, database_url))
    key = signing.load(challenge.folder / SIGNING_KEY)
    name = workers.name_of(os.getpid())
    over = ended.is_set if parent is None else (lambda: ended.is_set() or os.getppid() != parent)
    workers.Worker(challenge, database, key, name, over).run(until_empty=until_empty)


def _proven(challenge: Challenge) -> Challenge:
    """Return a challenge of which each phase admits what can be computed here; raises BenchbotError for too little."""
    phases = {}
    for name, phase in challenge.phases.items():
        lacking = workers.prove(challenge, phase)
        for mode, why in lacking.items():
            console.note(f"{phase.title} admits no solution in a {mode}, which this machine cannot run: {why}")
        phases[name] = replace(phase, modes=tuple(mode for mode in phase.modes if mode not in lacking))
    return replace(challenge, phases=phases)


def site(challenge: Challenge, database: Database, public_url: str | None = None) -> Site:
    """Return a challenge as it is served; raises BenchbotError when a method is not installed, or the key is gone."""
    plugins = plugin_manager.load()
    evaluators = {phase.method: plugins.record("evaluators", phase.method) for phase in challenge.phases.values()}
    try:
        token = (challenge.folder / ORGANISER_TOKEN).read_text("utf-8").strip()
    except OSError as error:
        raise BenchbotError(
            f"The organiser's token is not in {challenge.folder}.", str(error), "Bring it back from your backup."
        ) from error
    key = signing.load(challenge.folder / SIGNING_KEY)
    secure = (public_url or "").startswith("https:")
    return Site(challenge, database, key, evaluators, token, secure)


def _enter_baselines(served: Site) -> None:
    """Hand in each baseline once to each phase, as a team of its own."""
    challenge = served.challenge
    for baseline in challenge.baselines:
        team = people.add_baseline(served.database, baseline["name"])
        for phase in challenge.phases.values():
            if _is_entered(served, team.id, phase.name):
                continue
            what = str(challenge.folder / baseline["folder"]) if "folder" in baseline else None
            admitted = handing_in.Admitted(phase.title, phase.modes, challenge.largest_bytes)
            made = handing_in.archive(what, baseline.get("command"), baseline.get("example"), admitted)
            with made as archive, uploads.partial(served) as file:
                shutil.copy(archive, file.name)
                try:
                    uploads.accept(served, phase, team, Path(file.name), intake.sha256_of(archive), "", None)
                except BenchbotError:
                    # Another server on the same database may have handed it in meanwhile.
                    if not _is_entered(served, team.id, phase.name):
                        raise


def _is_entered(served: Site, team: int, phase: str) -> bool:
    return any(row.phase == phase for row in submissions.of_team(served.database, team))


def _keep_workers(served: Site, database_url: str | None, count: int, ended: threading.Event) -> None:
    """Keep so many workers running; their output goes to `workers.log` in the challenge's folder.

    What a worker had claimed that has died is back in the queue at once, not only when its lease has run out.
    """
    challenge = served.challenge
    words = ["challenge", "worker", str(challenge.folder), "--parent", str(os.getpid())]
    words += [] if database_url is None else ["--database", database_url]
    running: list[Popen[bytes]] = []
    with (challenge.folder / "workers.log").open("ab") as log:
        while not ended.is_set():
            for died in [process for process in running if process.poll() is not None]:
                running.remove(died)
                with suppress(DBAPIError):  # a database that is away for a while: the lease runs out
                    queue.give_back_of(served.database, workers.name_of(died.pid))
            running += [start_module("benchbot", *words, output=log) for _ in range(count - len(running))]
            ended.wait(RESTART_S)
        for process in running:
            process.send_signal(signal.SIGTERM)
        for process in running:
            process.wait()


def _listening(host: str, port: int) -> socket.socket:
    try:
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        raise BenchbotError(
            f"Cannot listen at {host}, port {port}.",
            error.strerror or str(error),
            "Name another with --port, or 0 for one that is free.",
            exit_code=ExitCode.INTERNAL,
        ) from error
