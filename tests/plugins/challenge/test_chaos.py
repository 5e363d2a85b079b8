"""Whatever is killed, and whenever: nothing is lost or scored twice, and the leaderboard is the undisturbed one."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.command_line import CommandLine
from tests.plugins.batch.test_batch import TRUTHS, truth
from tests.plugins.challenge.chaos import require_as_undisturbed, storm, undisturbed
from tests.plugins.challenge.conftest import PostgreSQL


@pytest.fixture
def server() -> Iterator[PostgreSQL]:
    """A PostgreSQL server of this test's own, which it kills."""
    running = PostgreSQL()
    yield running
    running.stop()


def test_kills_of_servers_workers_and_database_change_nothing(
    cli: CommandLine, make_plugin: Callable[..., Path], server: PostgreSQL
) -> None:
    make_plugin("arena-truths", TRUTHS, {"ground_truths/1.json": truth(1)})
    expected = undisturbed(cli, 2, 2)
    url = server.new_database()
    outcome = storm(cli, url, server, teams=2, each=2, kills=6, spacing_s=1.5, patience_s=300)
    assert outcome.kills == {"server": 2, "worker": 2, "database": 2}
    require_as_undisturbed(outcome, expected)
    assert cli.no_process_is_left()
