"""Whatever is killed, and whenever: nothing is lost or scored twice, and the leaderboard is the undisturbed one."""

import json
import os
import random
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
from sqlalchemy import create_engine, text

from tests.command_line import BOTTLE, CommandLine, kill
from tests.plugins.batch.test_batch import TRUTHS, truth
from tests.plugins.challenge.conftest import PostgreSQL
from tests.plugins.challenge.test_command import declare, joined, served, solution

FINDS_IT = f"""\
import json, os, time
time.sleep(1)
found = {{"label_probs": [1, 0], **{BOTTLE!r}}}
result = {{"class_list": ["bottle", "background"], "objects": [found][:COUNT]}}
open(os.environ["BENCHBOT_RESULT"], "w").write(json.dumps({{"results": result}}))
"""
"""Claims one bottle where it is, or nothing: the method gives 1 or 0."""
UNDISTURBED = {"Ada": 1.0, "Bob": 0.0}
EACH, KILLS, PATIENCE_S = 2, 6, 300.0


@pytest.fixture
def server() -> Iterator[PostgreSQL]:
    """A PostgreSQL server of this test's own, which it kills."""
    running = PostgreSQL()
    yield running
    running.stop()


def workers(cli: CommandLine) -> list[int]:
    """Return the processes that are workers of this challenge."""
    mark = f"BENCHBOT_STATE_DIR={cli.variables['BENCHBOT_STATE_DIR']}".encode()
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if entry.name.isdigit() and mark in (entry / "environ").read_bytes():
                words = (entry / "cmdline").read_bytes().split(b"\0")
                found += [int(entry.name)] if b"--with-parent" in words else []
    return found


def test_kills_of_servers_workers_and_database_change_nothing(
    cli: CommandLine, make_plugin: Callable[..., Path], server: PostgreSQL
) -> None:
    cli.variables["BENCHBOT_DATA_DIR"] = str(cli.home / "data")
    make_plugin("arena-truths", TRUTHS, {"ground_truths/1.json": truth(1)})
    url = server.new_database()
    cli.variables["BENCHBOT_CHALLENGE_DATABASE"] = url
    declare(cli)
    # Two servers work as one.
    servers: list[Any] = [served(cli), served(cli)]
    handed_in = []
    for name, count in (("Ada", 1), ("Bob", 0)):
        folder = solution(cli, name.lower(), FINDS_IT.replace("COUNT", str(count)))
        joined(cli, servers[0][1], name)
        for number in range(EACH):
            where = servers[number % 2][1]
            membership = next(path for path in (cli.home / "data").rglob("challenges/*.json"))
            token = cli.folder / "token"
            token.write_text(json.loads(membership.read_text())["token"])
            words = ("--command", "python solution.py", "--token-file", "token")
            answer = cli("challenge", "submit", where, folder, *words)
            assert answer.returncode == 0, answer.stderr
            handed_in.append(answer.stdout.strip())
    chance = random.Random(7)
    for victim in (["worker", "server", "database"] * KILLS)[:KILLS]:
        time.sleep(chance.uniform(0.5, 2.5))
        if victim == "worker":
            for process in workers(cli)[:1]:
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
        elif victim == "server":
            kill(servers.pop(0)[0])
            servers.append(served(cli))
        else:
            server.kill()
            time.sleep(0.5)
            server.start()
    engine = create_engine(url)
    states = text("SELECT id, state, attempt FROM submissions ORDER BY number")
    deadline_s = time.monotonic() + PATIENCE_S
    while True:
        with engine.connect() as connection:
            rows = connection.execute(states).all()
        if all(row.state == "scored" for row in rows):
            break
        assert time.monotonic() < deadline_s, (rows, (cli.folder / "demo" / "workers.log").read_text()[-2000:])
        time.sleep(0.5)
    assert [row.id for row in rows] == handed_in
    with engine.connect() as connection:
        counted = connection.execute(text("SELECT submission FROM events WHERE action = 'scored'")).scalars().all()
    engine.dispose()
    assert sorted(counted) == sorted(handed_in)
    for _, where in servers:
        with urlopen(f"{where}/api/v1/phases/development/leaderboard") as answer:
            board = json.load(answer)
        assert {row["team"]: row["score"] for row in board["standings"]} == UNDISTURBED
        assert {row["entries"] for row in board["standings"]} == {EACH}
