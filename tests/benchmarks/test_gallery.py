"""The gallery's page is made in parts, and its light is what a run can set."""

from benchbot_sim_taichi.daylight import Daylight
from benchbot_sim_taichi.lighting import Lighting
from benchmarks.gallery import DOCS, TIMES, light_at, with_row, with_sheet

PAGE = "# Gallery\n\n| environment | noon |\n|---|---|\n\nThe end.\n"


def test_rows_are_added_in_order_and_replaced() -> None:
    page = PAGE
    for cells in (["`b:1`", "1"], ["`a:2`", "2"], ["`b:1`", "3"]):
        page = with_row(page, cells)
    assert page == PAGE.replace("|---|---|\n", "|---|---|\n| `a:2` | 2 |\n| `b:1` | 3 |\n")


def test_a_sheet_is_shown_once() -> None:
    page = with_sheet(with_sheet(PAGE, "office"), "house")
    assert with_sheet(page, "office") == page
    assert page.count("gallery-office.jpg") == page.count("gallery-house.jpg") == 1


def test_the_page_that_there_is_can_be_added_to() -> None:
    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    assert "| `nowhere:1` | 1 | 2 | 3 |\n" in with_row(page, ["`nowhere:1`", "1", "2", "3"])


def test_an_environment_keeps_its_north_and_the_colour_of_its_lamps() -> None:
    by_time = {"time": "14:00", "date": "2023-04-20", "north_deg": 90.0, "lamps": {"on": "none", "temperature_k": 2700}}
    for at, wanted in TIMES.items():
        lighting = Lighting.from_mapping(light_at(at, by_time))
        assert isinstance(lighting.sky, Daylight)
        assert (lighting.sky.north_deg, lighting.lamps.temperature_k) == (90.0, 2700)
        assert light_at(at, {"sun": {"elevation_deg": 3.0}}) == {
            "time": wanted["time"],
            "lamps": {"on": wanted["lamps"]},
        }
