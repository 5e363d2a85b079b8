"""A challenge whose servers, workers and database are killed (SIGKILL) at random moments, while teams hand in.

Small in the tests, long in `python -m benchmarks challenge --chaos`.
"""

import base64
import json
import os
import random
import signal
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from sqlalchemy import create_engine, text

from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.challenge import intake, signing
from benchbot.plugins.challenge.client import Server
from benchbot.plugins.challenge.document import SCORED
from tests.command_line import BOTTLE, CommandLine, ended
from tests.plugins.challenge.conftest import PostgreSQL
from tests.plugins.challenge.test_command import declare, served

FINDS_IT = f"""\
import json, os, time
time.sleep(1)
found = {{"label_probs": [LABEL, 1 - LABEL], **{BOTTLE!r}}}
result = {{"class_list": ["bottle", "background"], "objects": [found]}}
open(os.environ["BENCHBOT_RESULT"], "w").write(json.dumps({{"results": result}}))
"""
"""Claims one bottle where it is, and how sure it is of that: the surer, the better."""
WAIT_S = 0.5


@dataclass(frozen=True)
class Outcome:
    """How often each was killed, the leaderboard, what each submission was scored with, and how many attempts it took.

    `scored` holds a submission as often as its score was written.
    """

    kills: dict[str, int]
    board: list[tuple[str, float, int]]
    scores: dict[str, float]
    attempts: dict[str, int]
    scored: list[str]
    refused_again: int
    """So many answers were lost on their way: the team sent the same again, which did not count twice."""
    wall_s: float


def storm(
    cli: CommandLine,
    url: str,
    postgresql: PostgreSQL | None,
    *,
    teams: int,
    each: int,
    kills: int,
    spacing_s: float,
    patience_s: float,
    seed: int = 7,
) -> Outcome:
    """Have teams hand in to two servers, which share a database, while kills come; return what became of it.

    Without PostgreSQL the database is a file, and servers and workers are killed. Each server has one worker.
    """
    start_s = time.monotonic()
    chance = random.Random(seed)
    cli.variables["BENCHBOT_CHALLENGE_DATABASE"] = url
    declare(cli, lambda document: document["phases"]["development"].pop("quota"))
    servers: list[Any] = [served(cli), served(cli)]
    hand_in = [_Team(cli, servers, number) for number in range(teams)]
    counted = dict.fromkeys(("server", "worker", *(["database"] if postgresql else [])), 0)
    with ThreadPoolExecutor(4) as threads:
        submitting = [threads.submit(team.submit, each) for team in hand_in]
        for number in range(kills):
            time.sleep(chance.uniform(0.2, 2 * spacing_s))
            victim = list(counted)[number % len(counted)]
            if victim == "database" and postgresql is not None:
                postgresql.kill()
                time.sleep(chance.uniform(0.2, 1.0))
                postgresql.start()
            elif victim == "server":
                dead, _ = servers.pop(chance.randrange(2))
                dead.kill()  # its workers see by themselves that it is gone
                servers.append(served(cli))
            else:
                running = workers(cli)
                if not running:  # the servers have just been started: their workers come in a moment
                    time.sleep(5)
                    running = workers(cli)
                with suppress(ProcessLookupError):
                    os.kill(chance.choice(running), signal.SIGKILL)
            counted[victim] += 1
        lost = sum(future.result() for future in submitting)
    rows = _when_scored(url, teams * each, start_s + patience_s)
    boards = [_board(where) for _, where in servers]
    assert boards[0] == boards[1], boards  # two servers on one database are one
    engine = create_engine(url)
    with engine.connect() as connection:
        scored = connection.execute(text("SELECT submission FROM events WHERE action = 'scored'")).scalars().all()
    engine.dispose()
    for process, _ in servers:
        process.terminate()
    assert [ended(process) for process, _ in servers] == [0, 0]
    return Outcome(
        kills=counted,
        board=boards[0],
        scores={row.id: row.score for row in rows},
        attempts={row.id: row.attempt for row in rows},
        scored=list(scored),
        refused_again=lost,
        wall_s=time.monotonic() - start_s,
    )


def label_of(team: int, number: int) -> float:
    """Return how sure a team's submission is."""
    return round(0.3 + 0.1 * ((team + 2 * number) % 7), 1)


def undisturbed(cli: CommandLine, teams: int, each: int) -> list[tuple[str, float, int]]:
    """Return the leaderboard that comes of it when nothing is killed: the surest of each team, run by itself."""
    surest = [max(label_of(team, number) for number in range(each)) for team in range(teams)]
    scores = {label: _score(cli, label) for label in sorted(set(surest))}
    return [(_name(team), scores[label], each) for team, label in enumerate(surest)]


def _score(cli: CommandLine, label: float) -> float:
    name, solution = f"sure_{label}.json", cli.script(f"sure_{label}.py", FINDS_IT.replace("LABEL", str(label)))
    words = ("--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1", "--native", solution)
    done = cli("submit", *words, "--results-location", name)
    assert done.returncode == 0, done.stderr
    answer = cli("eval", name, "--method", "omq", "--json")
    assert answer.returncode == 0, answer.stderr
    return float(json.loads(answer.stdout)["scores"]["OMQ"])


def workers(cli: CommandLine) -> list[int]:
    """Return the processes that are workers of this challenge."""
    mark = f"BENCHBOT_STATE_DIR={cli.variables['BENCHBOT_STATE_DIR']}".encode()
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if entry.name.isdigit() and mark in (entry / "environ").read_bytes():
                words = (entry / "cmdline").read_bytes().split(b"\0")
                found += [int(entry.name)] if words[4:6] == [b"challenge", b"worker"] else []
    return found


class _Team:
    """A team with a key, which sends what was not answered again: the same bytes, signed once."""

    def __init__(self, cli: CommandLine, servers: Sequence[tuple[Any, str]], number: int) -> None:
        self.servers, self.number = servers, number
        self.folder = cli.folder / f"team_{number}"
        self.folder.mkdir()
        self.key = signing.make(self.folder / "key")
        (invitation,) = cli("challenge", "invite", "demo").stdout.split()
        asked = {"invitation": invitation, "name": _name(number), "key": self.key.public}
        self.token = self._persist(lambda server: server.ask("POST", "/api/v1/join", asked))["token"]

    def submit(self, count: int) -> int:
        """Hand in so many; return how many answers were lost."""
        return sum(self._submit(number) for number in range(count))

    def _submit(self, number: int) -> bool:
        folder = self.folder / str(number)
        folder.mkdir()
        code = FINDS_IT.replace("LABEL", str(label_of(self.number, number)))
        (folder / "solution.py").write_text(code)
        archive = folder.with_suffix(".zip")
        intake.pack(folder, "python solution.py", archive)
        about = {"challenge": "demo", "phase": "development", "team": _name(self.number), "nonce": str(number)}
        envelope = self.key.sign(signing.SUBMISSION, intake.sha256_of(archive), about)
        headers = {signing.HEADER: base64.b64encode(json.dumps(envelope).encode()).decode()}
        path = "/api/v1/phases/development/submissions"
        try:
            self._persist(lambda server: server.ask("POST", path, file=archive, headers=headers))
        except BenchbotError as error:
            if "handed in already" not in error.title:
                raise
            return True
        return False

    def _persist(self, ask: Callable[[Server], Any]) -> Any:
        while True:
            where = random.choice(list(self.servers))[1]
            try:
                return ask(Server(where, getattr(self, "token", None)))
            except BenchbotError as error:
                if error.exit_code != ExitCode.INTERNAL:
                    raise
                time.sleep(WAIT_S)


def _name(team: int) -> str:
    return f"Team {team:02}"


def _when_scored(url: str, count: int, deadline_s: float) -> Sequence[Any]:
    engine = create_engine(url)
    chosen = text(
        "SELECT s.id, s.state, s.attempt, s.reason, c.score FROM submissions s "
        "LEFT JOIN scores c ON c.submission = s.id ORDER BY s.number"
    )
    while True:
        with engine.connect() as connection:
            rows = connection.execute(chosen).all()
        if len(rows) == count and all(row.state == SCORED for row in rows):
            engine.dispose()
            return rows
        assert time.monotonic() < deadline_s, [row for row in rows if row.state != SCORED]
        time.sleep(WAIT_S)


def _board(where: str) -> list[tuple[str, float, int]]:
    with urlopen(f"{where}/api/v1/phases/development/leaderboard") as answer:
        standings = json.load(answer)["standings"]
    return sorted((row["team"], row["score"], row["entries"]) for row in standings)


def require_as_undisturbed(outcome: Outcome, expected: list[tuple[str, float, int]]) -> None:
    """Require that nothing is lost, that nothing counts twice, and that the leaderboard is the undisturbed one."""
    assert sorted(outcome.scored) == sorted(outcome.scores)
    assert outcome.board == expected
