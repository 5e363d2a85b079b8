"""The viewer as people use it, in a browser."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from benchbot_view.export import write
from benchbot_view.index import Index, Source
from benchbot_view.rows import id_of
from plugins.view.tests.conftest import result, save, serving
from tests.browser import look, violations

pytestmark = pytest.mark.xdist_group("browser")


@pytest.fixture(scope="module")
def files(results: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exported") / "site"
    return write(Index([Source.of(str(results))]), "results", folder, with_ground_truth=True).parent


@pytest.fixture
def quiet(tab: Page) -> Iterator[Page]:
    """A page that must not complain of anything."""
    said: list[str] = []
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
    yield tab
    assert [text for text in said if not any(word in text for word in ("GPU stall", "GL Driver", "Canvas2D"))] == []


def test_three_clicks_lead_from_a_bad_score_to_the_frame_that_explains_it(quiet: Page, address: str) -> None:
    quiet.goto(address)
    expect(quiet.locator("#count")).to_contain_text("3 episodes")
    expect(quiet.locator("tbody tr", has_text="good")).to_contain_text("0.")

    quiet.locator("tbody tr", has_text="good").get_by_role("link").click()  # 1
    expect(quiet.locator("#no-pictures")).to_be_hidden()
    expect(quiet.locator("tr[data-object]", has_text="potted plant").first.locator(".seen")).to_contain_text("frame")
    quiet.get_by_role("button", name="missed", exact=False).click()  # 2: those that were missed
    quiet.locator("tr[data-object]", has_text="potted plant").first.get_by_role("button").click()  # 3

    expect(quiet.locator("#reel-title")).to_contain_text("this potted plant, which was missed")
    assert quiet.locator("#reel button").count() > 0
    expect(quiet.locator(".map .labels text")).to_have_text("potted plant")
    best = quiet.locator("#reel button").first.get_attribute("data-frame")
    expect(quiet.locator("#slider")).to_have_value(best or "")
    drawn = quiet.evaluate(COUNT_YELLOW)
    assert drawn > 50, "The box of the plant is not drawn into the picture."
    # The state is the address.
    until(quiet, "location.hash.includes('o=')")
    address_of_it = quiet.url
    quiet.goto("about:blank")
    quiet.goto(address_of_it)
    expect(quiet.locator("#reel-title")).to_contain_text("this potted plant")


def until(tab: Page, expression: str) -> None:
    """Wait until an expression holds; `wait_for_function` would need a policy that lets text become a script."""
    for _ in range(200):
        if tab.evaluate(expression):
            return
        tab.wait_for_timeout(50)
    raise AssertionError(expression)


COUNT_YELLOW = """() => {
  const canvas = document.querySelector('figure[data-kind=frame] canvas');
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i] > 230 && data[i + 1] > 210 && data[i + 2] < 190) count += 1;
  return count;
}"""


PIXEL = "document.querySelector('figure[data-kind=frame] canvas').getContext('2d').getImageData(9, 9, 1, 1).data[0]"
SHADES = [40 + 30 * number for number in range(6)]


def shows(tab: Page, number: int) -> None:
    """Wait until the picture of an observation is shown."""
    until(tab, f"Math.abs({PIXEL} - {SHADES[number]}) < 6")


def test_a_picture_that_comes_late_is_shown_if_it_is_still_the_one(quiet: Page, address: str, results: Path) -> None:
    held: dict[str, Route] = {}
    quiet.route(re.compile(r"/frame/0000[25]\.jpg$"), lambda route: held.update({route.request.url[-5]: route}))
    quiet.goto(address)
    with quiet.expect_request("**/00005.jpg"), quiet.expect_request("**/00002.jpg"):  # ahead of the slider
        # Not until all is loaded: pictures that are held are part of that.
        episode = f"episode/{id_of(results / 'good' / 'result.json')}.html"
        quiet.goto(address.partition("?")[0] + episode, wait_until="commit")
    expect(quiet.locator("#now")).to_contain_text("objects seen")  # all else is there
    shows(quiet, 0)
    quiet.keyboard.press("End")
    expect(quiet.locator("#now")).to_contain_text("6 of 6")

    held["5"].continue_()
    shows(quiet, 5)
    expect(quiet.locator(".waiting")).to_have_count(0)
    with quiet.expect_response("**/00002.jpg"):
        held["2"].continue_()  # nobody waits for this one
    quiet.wait_for_timeout(100)
    shows(quiet, 5)


def test_a_picture_that_did_not_come_is_fetched_again(tab: Page, address: str, results: Path) -> None:
    failing = "**/picture/*/frame/00005.jpg"
    tab.route(failing, lambda route: route.abort())
    tab.goto(address)
    tab.goto(address.partition("?")[0] + f"episode/{id_of(results / 'good' / 'result.json')}.html#t=5")
    expect(tab.locator("#now")).to_contain_text("objects seen")
    expect(tab.locator("figure[data-kind=frame].waiting")).to_have_count(1)
    tab.unroute(failing)
    tab.keyboard.press("ArrowLeft")
    shows(tab, 4)
    tab.keyboard.press("ArrowRight")
    shows(tab, 5)


def test_everything_moves_with_one_slider_and_with_keys(quiet: Page, address: str, results: Path) -> None:
    quiet.goto(address)
    quiet.goto(address.partition("?")[0] + f"episode/{id_of(results / 'good' / 'result.json')}.html")
    expect(quiet.locator("#now")).to_contain_text("1 of 6")
    shows(quiet, 0)
    place = quiet.locator(".robot").get_attribute("transform")

    quiet.keyboard.press("End")

    expect(quiet.locator("#now")).to_contain_text("6 of 6")
    expect(quiet.locator("#now")).to_contain_text("2.5 s")
    shows(quiet, 5)
    expect(quiet.locator(".robot")).not_to_have_attribute("transform", str(place))
    quiet.keyboard.press("ArrowLeft")
    expect(quiet.locator("#slider")).to_have_value("4")
    quiet.keyboard.press("n")
    expect(quiet.locator("tr.chosen")).to_have_count(1)
    expect(quiet.locator("body")).not_to_contain_text("is being worked out")  # the page is drawn anew after it
    quiet.locator("tr[data-object]").last.hover()
    expect(quiet.locator("svg.map rect.lit").first).to_be_visible()
    quiet.keyboard.press("v")
    expect(quiet.locator("#space-note")).to_contain_text("No depth was recorded")
    quiet.keyboard.press("?")
    expect(quiet.get_by_role("dialog")).to_be_visible()


def test_the_table_is_filtered_sorted_and_walked_with_keys(quiet: Page, address: str) -> None:
    quiet.goto(address)
    expect(quiet.locator("#count")).to_contain_text("3 episodes")
    quiet.keyboard.press("/")
    quiet.keyboard.type("failed")
    expect(quiet.locator("#count")).to_contain_text("1 of 3")
    assert quiet.evaluate("document.querySelectorAll('#table img').length") == 0
    quiet.keyboard.press("Escape")
    expect(quiet.locator("#count")).to_contain_text("3 episodes")
    quiet.get_by_role("button", name="Solution").click()
    expect(quiet.get_by_role("columnheader", name="Solution")).to_have_attribute("aria-sort", "ascending")
    quiet.locator("h1").click()
    quiet.keyboard.press("j")
    quiet.keyboard.press("j")
    expect(quiet.locator("tr.at")).to_have_attribute("aria-rowindex", "3")
    quiet.keyboard.press("Enter")
    quiet.wait_for_url("**/episode/*")


def test_two_solutions_are_compared_side_by_side_in_step(quiet: Page, address: str) -> None:
    quiet.goto(address)
    expect(quiet.locator("tbody tr", has_text="poor")).to_contain_text("0.000")
    expect(quiet.locator("tbody tr", has_text="good")).to_contain_text("0.")
    quiet.keyboard.press("c")
    quiet.locator("#a").select_option("good")
    quiet.locator("#b").select_option("poor")
    expect(quiet.locator("#pairs-note")).to_contain_text("1 pair of the same episode: 1 better, 0 worse")
    quiet.locator("#pairs a").click()
    expect(quiet.locator("#now")).to_contain_text("of 6 and 6", timeout=20_000)

    quiet.keyboard.press("ArrowRight")
    quiet.keyboard.press("ArrowRight")

    for side in ("#left", "#right"):
        expect(quiet.frame_locator(side).locator("#now")).to_contain_text("3 of 6")
    quiet.frame_locator("#left").locator("body").press("End")
    expect(quiet.frame_locator("#right").locator("#now")).to_contain_text("6 of 6")
    assert "t=" in quiet.url


def test_a_batch_appears_as_it_grows(quiet: Page, tmp_path: Path) -> None:
    keys = [f"{number:064x}" for number in range(40)]
    episodes = [
        {"key": key, "label": f"e{i}", "robot": "carter", "environment": "miniroom:1", "seed": i}
        for i, key in enumerate(keys)
    ]
    batch = tmp_path / "night"
    (batch / "events").mkdir(parents=True)
    (batch / "plan.json").write_text(json.dumps({"task": "t", "episodes": episodes}), "utf-8")
    with serving(batch) as address:
        quiet.goto(f"{address}#state=done")
        expect(quiet.locator("#state option")).to_have_count(2)
        for number in (3, 4):
            save(batch / "episodes" / f"e{number}-{keys[number][:8]}" / "result.json", result("x", number))
            with (batch / "events" / "w.jsonl").open("a") as file:
                file.write(json.dumps({"time_s": 1.0, "who": "w", "what": "finished", "key": keys[number]}) + "\n")
        quiet.goto(f"{address.partition('?')[0]}#state=done")
        expect(quiet.locator("#count")).to_contain_text("2 of 40 episodes", timeout=30_000)


def test_an_export_opens_from_a_disk_without_a_network(quiet: Page, files: Path, results: Path) -> None:
    asked: list[str] = []
    quiet.on("request", lambda request: asked.append(request.url))
    quiet.context.set_offline(True)

    quiet.goto((files / "index.html").as_uri())
    expect(quiet.locator("#count")).to_contain_text("3 episodes · mean")
    quiet.keyboard.press("h")
    expect(quiet.locator("#heat a").first).to_be_visible()
    quiet.keyboard.press("e")
    quiet.locator("tbody tr", has_text="good").get_by_role("link").click()
    expect(quiet.locator("#now")).to_contain_text("objects seen")
    quiet.keyboard.press("n")
    expect(quiet.locator("#reel-title")).to_contain_text("potted plant")
    quiet.keyboard.press("v")
    expect(quiet.locator("#space-note")).to_contain_text("No depth was recorded")
    both = f"#a={id_of(results / 'good' / 'result.json')}&b={id_of(results / 'poor' / 'result.json')}"
    quiet.goto((files / "side-by-side.html").as_uri() + both)
    expect(quiet.locator("#now")).to_contain_text("of 6 and 6")
    quiet.keyboard.press("End")
    expect(quiet.frame_locator("#right").locator("#now")).to_contain_text("6 of 6")

    assert {url.partition(":")[0] for url in asked} <= {"file", "data"}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_on_any_page_and_all_fit_a_phone(tab: Page, address: str, results: Path, scheme: str) -> None:
    tab.goto(address)
    expect(tab.locator("tbody tr", has_text="poor")).to_contain_text("0.000")
    expect(tab.locator("tbody tr", has_text="good")).to_contain_text("0.")
    base = address.partition("?")[0]
    good, poor, failed = (id_of(results / name / "result.json") for name in ("good", "poor", "failed"))
    ready = {
        f"{base}#": "tbody a",
        f"{base}#view=heat": "#heat a",
        f"{base}#view=pairs&a=good&b=poor": "#pairs a",
        f"{base}episode/{good}.html": "#slider",
        f"{base}episode/{good}.html#pane=3d": "#space-canvas",
        f"{base}episode/{failed}.html": ".alert",
        f"{base}side-by-side.html#a={good}&b={poor}": "#slider",
    }
    for url, selector in ready.items():
        look(tab, 1280, scheme)
        tab.goto("about:blank")
        tab.goto(url)
        tab.locator(selector).first.wait_for()
        assert violations(tab) == [], url
        look(tab, 390, scheme)
        assert tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), url
