"""A run and a batch that are under way, in a browser: started with the commands, shown by the server."""

from multiprocessing import resource_tracker
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from benchbot.viewing import live
from benchbot_view.rows import id_of
from plugins.view.tests.conftest import serving
from tests.browser import look, violations
from tests.cli.solutions import PASSIVE
from tests.command_line import CommandLine
from tests.plugins.batch.conftest import Batches, batches, sources  # noqa: F401 - fixtures
from tests.supervisor.harness import eventually

pytestmark = pytest.mark.xdist_group("browser")
PATIENCE_S = 60.0
PATIENCE_MS = 1000 * PATIENCE_S
SLOWLY = """\
import pathlib, time
here = pathlib.Path({here!r})
while not (here / "go").exists():
    time.sleep(0.05)
"""


def test_a_run_is_seen_while_it_is_under_way_and_leads_to_its_result(
    cli: CommandLine, monkeypatch: pytest.MonkeyPatch, tab: Page, tmp_path: Path
) -> None:
    for name in ("BENCHBOT_STATE_DIR", "BENCHBOT_CACHE_DIR"):
        monkeypatch.setenv(name, cli.variables[name])
    held = "import pathlib, time\nwhile not pathlib.Path('{}').exists(): time.sleep(0.05)\n"
    seen = held.format("go") + PASSIVE + held.format("end")
    words = ("--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1", "--max-steps", "9")
    submitted = cli.start(
        "submit", *words, "--native", cli.script("seen.py", seen), "--results-location", "result.json"
    )
    assert eventually(lambda: bool(live()), PATIENCE_S)

    with serving(tmp_path, everything=True) as address:
        tab.goto(address)
        tab.locator("tbody tr", has_text="arena:1").get_by_role("link").click()
        expect(tab.locator("#state")).to_have_text("under way", timeout=PATIENCE_MS)
        (cli.folder / "go").touch()
        expect(tab.locator("figure[data-kind=frame]")).to_be_visible(timeout=PATIENCE_MS)
        expect(tab.locator("#frames")).not_to_have_text("0")
        expect(tab.locator(".robot")).to_be_visible()
        expect(tab.locator("#log")).to_contain_text("step 1")
        assert tab.evaluate(COLORS) > 1, "There is no picture."
        assert violations(tab) == []
        look(tab, 390, "dark")
        assert violations(tab) == []
        assert tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth")

        (cli.folder / "end").touch()
        submitted.communicate(timeout=PATIENCE_S)
        expect(tab.locator("#state")).to_have_text("ended", timeout=PATIENCE_MS)


COLORS = """() => {
  const canvas = document.querySelector('figure[data-kind=frame] canvas');
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  const found = new Set();
  for (let i = 0; i < data.length; i += 4) found.add(`${data[i]} ${data[i + 1]} ${data[i + 2]}`);
  return found.size;
}"""


def test_a_driven_batch_grows_before_ones_eyes(
    batches: Batches,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
    tab: Page,
) -> None:
    # It lives as long as this process, and must not be taken for one that the batch left.
    resource_tracker.ensure_running()
    for name in ("BENCHBOT_STATE_DIR", "BENCHBOT_CACHE_DIR", "BENCHBOT_PLUGINS", "PYTHONPATH"):
        monkeypatch.setenv(name, batches.cli.variables[name])
    here, folder = batches.cli.home, batches.path("night")
    batches.cli.script("passive.py", SLOWLY.format(here=str(here)) + PASSIVE)
    driver = batches.cli.start(*batches.words("night", "--jobs", "1", "--no-canary", seeds="0..1", envs="arena:1"))
    assert eventually((folder / "plan.json").is_file, PATIENCE_S)

    with serving(folder) as address:
        tab.goto(address)
        expect(tab.locator("#count")).to_contain_text("2 episodes")
        expect(tab.locator("#batches")).to_contain_text("0 of 2, 1 running", timeout=PATIENCE_MS)
        expect(tab.locator("tbody .badge", has_text="running")).to_have_count(1, timeout=PATIENCE_MS)
        expect(tab.locator("tbody a")).to_have_count(0)
        (here / "go").touch()
        expect(tab.locator("tbody .badge", has_text="done")).to_have_count(2, timeout=PATIENCE_MS)
        expect(tab.locator("tbody a")).to_have_count(2)
        driver.communicate(timeout=PATIENCE_S)
        expect(tab.locator("#batches")).to_be_hidden(timeout=PATIENCE_MS)
        tab.locator("tbody a").first.click()
        expect(tab.locator("#now")).to_contain_text("1 of")


def test_a_result_that_is_gone_says_so(tab: Page, tmp_path: Path) -> None:
    (tmp_path / "events").mkdir()
    key = "0" * 64
    planned = f'{{"key": "{key}", "label": "e", "robot": "carter", "environment": "miniroom:1", "seed": 0}}'
    (tmp_path / "plan.json").write_text(f'{{"task": "t", "episodes": [{planned}]}}', "utf-8")
    with serving(tmp_path) as address:
        tab.goto(address)
        id_ = id_of(tmp_path / "episodes" / f"e-{key[:8]}" / "result.json")
        tab.goto(f"{address.partition('?')[0]}episode/{id_}.html")
        expect(tab.locator("h1")).to_have_text("This episode has no result yet.")
        for scheme in ("light", "dark"):
            look(tab, 390, scheme)
            assert violations(tab) == []
