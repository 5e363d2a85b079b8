"""A team's way through the pages in a real browser: join, hand in, see it queued, and the leaderboard."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import uvicorn

from benchbot.plugins.challenge import intake, people
from benchbot.plugins.challenge.document import Phase
from benchbot.plugins.challenge.web.app import create_app
from benchbot.plugins.challenge.web.site import Site
from tests.browser import look, violations
from tests.plugins.challenge.conftest import kept, score_of

if TYPE_CHECKING:
    from playwright.sync_api import Page

pytestmark = pytest.mark.xdist_group("browser")


@pytest.fixture
def address(site: Site) -> Iterator[str]:
    """The address of the site, served."""
    server = uvicorn.Server(uvicorn.Config(create_app(site), port=0, log_config=None, lifespan="off"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.02)
    yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    server.should_exit = True
    thread.join()


def require_fine(tab: "Page") -> None:
    """Require that a page is accessible, and no wider than its window, at two widths in two schemes."""
    for width in (1280, 390):
        for scheme in ("light", "dark"):
            look(tab, width, scheme)
            assert violations(tab) == []
            assert tab.evaluate("document.documentElement.scrollWidth") <= width
    look(tab, 1280, "light")


def test_a_team_joins_hands_in_and_finds_itself_on_the_leaderboard(
    site: Site, phase: Phase, address: str, tab: "Page", tmp_path: Path
) -> None:
    (tmp_path / "solution").mkdir()
    (tmp_path / "solution" / "solution.py").write_text("print('hello')\n", "utf-8")
    intake.pack(tmp_path / "solution", "python solution.py", tmp_path / "packed.zip")
    tab.goto(address)
    require_fine(tab)
    tab.get_by_role("link", name="Enter").click()
    require_fine(tab)
    tab.get_by_label("Invitation").fill(people.invite(site.database))
    tab.get_by_label("Name of your team").fill("<b>Ada</b>")
    tab.get_by_role("button", name="Join").click()
    token = tab.locator("code.token").inner_text()
    require_fine(tab)
    tab.get_by_role("link", name="Enter with it").click()
    tab.get_by_label("Token").fill(token)
    tab.get_by_role("button", name="Enter").click()
    tab.get_by_label("What it is").fill("first try")
    tab.get_by_label("Archive").set_input_files(tmp_path / "packed.zip")
    tab.get_by_role("button", name="Submit").click()
    row = tab.get_by_role("row").filter(has_text="first try")
    assert "queued" in row.inner_text()
    require_fine(tab)
    row.get_by_role("button", name="Withdraw").click()
    assert "withdrawn" in tab.get_by_role("row").filter(has_text="first try").inner_text()
    for number, name in enumerate(("Bob", "Eve", "Zoë")):
        score_of(site, phase, name, 0.9 - number / 10, pictures=[kept(site.challenge)])
    tab.get_by_role("link", name="Development").click()
    table = tab.get_by_role("region", name="Leaderboard")
    assert [cell.inner_text() for cell in table.get_by_role("rowheader").all()] == ["Bob", "Eve", "Zoë"]
    require_fine(tab)
    picture = tab.get_by_role("img", name="Map of miniroom:1 from above: what Bob found, beside what is there")
    assert picture.evaluate("image => image.complete && image.naturalWidth") == 30
    tab.get_by_role("link", name="History").click()
    chart = tab.get_by_role("img", name="The score of each team over time")
    assert [name in chart.inner_html() for name in ("Bob", "Eve", "Zoë")] == [True] * 3
    require_fine(tab)
    tab.goto(f"{address}/mine")
    tab.get_by_role("link", name="first try").click()
    states = tab.get_by_role("region", name="States")
    assert [cell.inner_text() for cell in states.get_by_role("rowheader").all()] == ["queued", "withdrawn"]
    require_fine(tab)
