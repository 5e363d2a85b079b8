"""A challenge under load: leaderboard, uploads, and the queue with a thousand workers; and, if asked, kills.

The leaderboard has 500 teams and 20,000 submissions; 200 readers load its page once a second each, while a submission
is scored every two seconds. 50 teams upload 100 MB each at once. The queue is simulated by its own code on its own
database: 10,000 submissions, 1,000 workers of which some die, and a clock that jumps from event to event.
`--chaos` has 20 teams hand in 5 submissions each while servers, workers and the database are killed 30 times, and
compares the leaderboard with the undisturbed one. Everything speaks over loopback or unix sockets.

python -m benchmarks.bench_challenge [--only NAME] [--chaos sqlite|postgresql] [--json FILE]
"""

import argparse
import asyncio
import json
import os
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

SAMPLE_PLUGIN = Path(__file__).parent.parent / "tests" / "sample_plugin"
COMMAND = [sys.executable, "-m", "benchbot"]


TEAMS, SUBMISSIONS, PLACES = 500, 20_000, 10
READERS, READING_S, SCORED_EVERY_S = 200, 30.0, 2.0
UPLOADS, UPLOAD_BYTES = 50, 100_000_000


@contextmanager
def served(folder: Path) -> Iterator[tuple[int, str, int]]:
    """Serve the challenge in a folder without workers; yield the server's process, its host and its port."""
    words = ["challenge", "serve", str(folder), "--port", "0", "--workers", "0"]
    process = subprocess.Popen([*COMMAND, *words], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    try:
        line = next(line for line in process.stderr if "is served at" in line)
        yield process.pid, "127.0.0.1", int(line.partition("127.0.0.1:")[2].partition(".")[0])
    finally:
        process.terminate()
        process.wait()
        process.stderr.close()


def processor_s(process: int) -> float:
    """Return the processor time that a process has used."""
    fields = Path(f"/proc/{process}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def peak_mib(process: int) -> float:
    """Return the most memory that a process has had at once."""
    status = Path(f"/proc/{process}/status").read_text("ascii")
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM"))) / 1024


def fill(folder: Path, url: str) -> None:
    """Write teams and their submissions into a database, all scored but what is to be scored while readers read."""
    from sqlalchemy import insert

    from benchbot.plugins.challenge import signing, tables
    from benchbot.plugins.challenge.database import Database

    chance = random.Random(1)
    database = Database(url)
    key = signing.load(folder / "challenge.key")
    envelope = key.sign(signing.SCORE, "0" * 64, {"score": 0.5, "statement": "0" * 64})
    now = time.time()
    ability = [chance.betavariate(4, 3) for _ in range(TEAMS)]
    waiting = int(READING_S / SCORED_EVERY_S) + 5
    teams, handed_in, scores = [], [], []
    for team in range(TEAMS):
        name = f"Team {team:03}"
        digest = f"{team:064x}"
        teams.append({"id": team + 1, "name": name, "folded": name.lower(), "token": digest, "joined_at": now})
    for number in range(SUBMISSIONS):
        team, identifier = chance.randrange(TEAMS), f"{number:016x}"
        values = [min(max(chance.gauss(ability[team], 0.1), 0.0), 1.0) for _ in range(PLACES)]
        is_scored = number < SUBMISSIONS - waiting
        handed_in.append(
            {
                "id": identifier,
                "number": number + 1,
                "team": team + 1,
                "phase": "development",
                "title": f"attempt {number}",
                "mode": "sandbox",
                "sha256": "0" * 64,
                "size_bytes": 100_000,
                "received_at": now - SUBMISSIONS + number,
                "statement": f"{number:064x}",
                "envelope": envelope,
                "state": "scored" if is_scored else "queued",
                "ended_at": now if is_scored else None,
            }
        )
        if is_scored:
            document = score_document(values)
            scores.append(
                {
                    "submission": identifier,
                    "phase": "development",
                    "score": statistics.fmean(values),
                    "document": document,
                    "envelope": envelope,
                    "scored_at": now,
                }
            )
    with database.writing() as connection:
        for table, rows in ((tables.teams, teams), (tables.submissions, handed_in), (tables.scores, scores)):
            connection.execute(insert(table), rows)
    database.engine.dispose()


def score_document(values: list[float]) -> dict[str, Any]:
    """Return what is kept of the scores of a submission: the headline in each place, with a mean and an interval."""
    mean = statistics.fmean(values)
    rows = [
        {"environment": f"place{place}:1", "seed": 0, "scores": {"OMQ": value, "avg_pairwise": value}}
        for place, value in enumerate(values)
    ]
    return {
        "scores": {"OMQ": mean},
        "intervals": {"OMQ": {"low": mean - 0.05, "high": mean + 0.05}},
        "rows": rows,
        "coverage": {"expected": len(rows), "scored": len(rows), "missing": [], "skipped": []},
    }


def leaderboard() -> dict[str, Any]:
    """Return how long readers wait for the leaderboard while it changes."""
    from threading import Event, Thread

    from benchbot.plugins.challenge import queue
    from benchbot.plugins.challenge.database import Database, url_of
    from benchbot.plugins.challenge.starting import make

    with tempfile.TemporaryDirectory(prefix="bb") as name:
        folder = Path(name) / "demo"
        challenge = make(folder, "Demo")
        fill(folder, url_of(challenge, None))
        database = Database(url_of(challenge, None))
        ended = Event()

        def score() -> None:
            while not ended.wait(SCORED_EVERY_S) and (claim := queue.claim(database, "w")) is not None:
                queue.finish(database, claim, 0.99, score_document([0.99] * PLACES), {"payload": "", "signatures": []})

        with served(folder) as (process, host, port):
            start_s = time.perf_counter()
            size, _ = asyncio.run(get(host, port, "/phases/development"))
            cold_s = time.perf_counter() - start_s
            writer = Thread(target=score)
            writer.start()
            used_s, start_s = processor_s(process), time.perf_counter()
            waits_s = asyncio.run(read(host, port, "/phases/development"))
            wall_s = time.perf_counter() - start_s
            ended.set()
            writer.join()
            used_s = processor_s(process) - used_s
            memory_mib = peak_mib(process)
        database.engine.dispose()
    cuts = statistics.quantiles(waits_s, n=100)
    print(
        f"leaderboard of {TEAMS} teams, {SUBMISSIONS} submissions: {size / 1024:.0f} KiB; the first in {cold_s:.2f} s"
    )
    print(
        f"  {READERS} readers, {len(waits_s) / wall_s:.0f} pages/s, a submission scored every {SCORED_EVERY_S:.0f} s:"
    )
    print(f"  p50 {cuts[49] * 1e3:.1f}, p99 {cuts[98] * 1e3:.1f}, most {max(waits_s) * 1e3:.0f} ms (load {_load()})")
    print(f"  {used_s / len(waits_s) * 1e3:.2f} ms of the server's processor a page; {memory_mib:.0f} MiB at most")
    return {"p50_s": cuts[49], "p99_s": cuts[98], "pages": len(waits_s), "processor_s": used_s, "mib": memory_mib}


async def get(host: str, port: int, path: str) -> tuple[int, float]:
    """Return the size of a page, and how long it took, over a connection of its own."""
    start_s = time.perf_counter()
    streams = await asyncio.open_connection(host, port, limit=2**22)
    size = await ask(*streams, path)
    streams[1].close()
    return size, time.perf_counter() - start_s


async def ask(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, path: str) -> int:
    """Return the size of a page that is asked for over an open connection."""
    writer.write(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower()
    assert " 200 " in head.splitlines()[0], head
    size = int(head.partition("content-length: ")[2].partition("\r\n")[0])
    await reader.readexactly(size)
    return size


async def read(host: str, port: int, path: str) -> list[float]:
    """Return how long each of the readers waited for each page: one a second, on a connection that stays open."""
    waits_s: list[float] = []
    end_s = time.perf_counter() + READING_S

    async def one() -> None:
        await asyncio.sleep(random.random())
        reader, writer = await asyncio.open_connection(host, port, limit=2**22)
        due_s = time.perf_counter()
        while due_s < end_s:
            await asyncio.sleep(due_s - time.perf_counter())
            await ask(reader, writer, path)
            waits_s.append(time.perf_counter() - due_s)
            due_s = max(due_s + 1.0, time.perf_counter())
        writer.close()

    await asyncio.gather(*(one() for _ in range(READERS)))
    return waits_s


def uploads() -> dict[str, Any]:
    """Return what it costs the server to receive large archives of many teams at once."""
    from concurrent.futures import ThreadPoolExecutor

    from benchbot.plugins.challenge import intake, people
    from benchbot.plugins.challenge.client import Server
    from benchbot.plugins.challenge.database import Database, url_of
    from benchbot.plugins.challenge.starting import make

    with tempfile.TemporaryDirectory(prefix="bb") as name:
        folder, solution = Path(name) / "demo", Path(name) / "solution"
        challenge = make(folder, "Demo")
        solution.mkdir()
        (solution / "solution.py").write_text("")
        with (solution / "weights.bin").open("wb") as file:
            for _ in range(UPLOAD_BYTES // 10**6):
                file.write(os.urandom(10**6))
        intake.pack(solution, "python solution.py", Path(name) / "packed.zip")
        shutil.rmtree(solution)
        database = Database(url_of(challenge, None))
        tokens = [
            people.join(database, challenge, people.invite(database), f"Team {number}") for number in range(UPLOADS)
        ]
        with served(folder) as (process, host, port), ThreadPoolExecutor(UPLOADS) as threads:
            asyncio.run(get(host, port, "/"))
            before_mib, used_s, start_s = peak_mib(process), processor_s(process), time.perf_counter()

            def upload(token: str) -> str:
                server = Server(f"http://{host}:{port}", token)
                path = "/api/v1/phases/development/submissions"
                return str(server.ask("POST", path, file=Path(name) / "packed.zip")["sha256"])

            digests = set(threads.map(upload, tokens))
            wall_s, used_s = time.perf_counter() - start_s, processor_s(process) - used_s
            memory_mib = peak_mib(process)
        assert digests == {intake.sha256_of(Path(name) / "packed.zip")}
        assert len(list((folder / "uploads").glob("*.zip"))) == UPLOADS
        database.engine.dispose()
    print(f"{UPLOADS} uploads of {UPLOAD_BYTES / 1e6:.0f} MB at once: {wall_s:.0f} s (load {_load()})")
    print(f"  {used_s / UPLOADS:.2f} s of the server's processor each; {before_mib:.0f} → {memory_mib:.0f} MiB at most")
    return {"wall_s": wall_s, "processor_s": used_s, "before_mib": before_mib, "mib": memory_mib}


def scheduler() -> dict[str, Any]:
    """Return how many workers work a long queue off, in simulated time, on PostgreSQL and SQLite."""
    from benchmarks.queue_simulation import simulated
    from tests.plugins.challenge.conftest import PostgreSQL

    server = PostgreSQL()
    try:
        with tempfile.TemporaryDirectory(prefix="bb") as name:
            urls = {"postgresql": server.new_database(), "sqlite": f"sqlite:///{name}/challenge.db"}
            return {kind: simulated(kind, url) for kind, url in urls.items()}
    finally:
        server.stop()


def chaos(kind: str) -> dict[str, Any]:
    """Return what 30 kills did to 100 submissions of 20 teams on two servers."""
    from tests.command_line import CommandLine
    from tests.plugin_factory import PluginFactory
    from tests.plugins.batch.test_batch import TRUTHS, truth
    from tests.plugins.challenge.chaos import require_as_undisturbed, storm, undisturbed
    from tests.plugins.challenge.conftest import PostgreSQL

    with tempfile.TemporaryDirectory(prefix="bb") as name:
        home, folder, site = (Path(name) / part for part in ("home", "work", "site"))
        for path in (home, folder, site):
            path.mkdir()
        PluginFactory(site).make("arena-truths", TRUTHS, {"ground_truths/1.json": truth(1)})
        variables = {
            **{key: value for key, value in os.environ.items() if not key.startswith("BENCHBOT_")},
            **{f"BENCHBOT_{part}_DIR": str(home / part.lower()) for part in ("STATE", "CACHE", "DATA")},
            "BENCHBOT_PLUGINS": "benchbot-sample,benchbot-eval-omq,arena-truths",
            "PYTHONPATH": os.pathsep.join(map(str, (site, SAMPLE_PLUGIN, SAMPLE_PLUGIN.parent.parent))),
            "TMPDIR": str(home),
            "COLUMNS": "120",
        }
        cli = CommandLine(home, variables, folder)
        server = PostgreSQL() if kind == "postgresql" else None
        url = f"sqlite:///{folder / 'challenge.db'}" if server is None else server.new_database()
        try:
            expected = undisturbed(cli, 20, 5)
            outcome = storm(cli, url, server, teams=20, each=5, kills=30, spacing_s=10, patience_s=3600)
            require_as_undisturbed(outcome, expected)
            assert cli.no_process_is_left(), cli.processes_left()
        finally:
            for process in cli.processes:
                process.kill()
            if server is not None:
                server.stop()
    again = sum(attempt > 1 for attempt in outcome.attempts.values())
    killed = ", ".join(f"{count} {what}" for what, count in outcome.kills.items())
    print(f"{kind}: {len(outcome.scores)} submissions, killed: {killed}; {outcome.wall_s:.0f} s (load {_load()})")
    print(f"  begun more than once: {again}; answers lost and asked again: {outcome.refused_again}")
    print(f"  scored once: {len(outcome.scored)} of {len(outcome.scores)}; the leaderboard is the undisturbed one")
    return {"kills": outcome.kills, "again": again, "answers_lost": outcome.refused_again, "wall_s": outcome.wall_s}


def _load() -> str:
    return f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


PARTS = {"leaderboard": leaderboard, "uploads": uploads, "scheduler": scheduler}


def main() -> None:
    """Measure what was asked for, or all but the kills."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=PARTS, help="measure this alone")
    parser.add_argument("--chaos", choices=["sqlite", "postgresql"], help="kill servers, workers and this database")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures here")
    options = parser.parse_args()
    if options.chaos:
        found = {"chaos": chaos(options.chaos)}
    else:
        found = {name: PARTS[name]() for name in ([options.only] if options.only else PARTS)}
    if options.json:
        options.json.write_text(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
