"""The gallery shows what `fidelity` measured, and its light is what a run can set."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchbot_sim_taichi.daylight import Daylight
from benchbot_sim_taichi.lighting import Lighting
from benchmarks.gallery import DOCS, main, with_row, with_sheet
from benchmarks.views import TIMES, light_at

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


def test_the_page_and_a_sheet_are_made_of_a_run_of_fidelity(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "images").mkdir()
    (tmp_path / "gallery.md").write_text(PAGE, encoding="utf-8")
    rows = []
    for name in ("den:2", "den:1"):
        for number, at in enumerate(TIMES):
            painted = np.full((90, 4 * 160, 3), 255, np.uint8)
            painted[:, :320] = 60 * number + 20 * int(name[-1])
            Image.fromarray(painted).save(tmp_path / f"{name.replace(':', '_')}-{at}-0.png")
            rows.append({"environment": name, "time": at, "view": 0, "rmse": number + 0.26, "ssim": 0.957})
    (tmp_path / "figures.json").write_text(json.dumps(rows), encoding="utf-8")
    words = ["gallery", tmp_path / "figures.json", tmp_path, "--docs", tmp_path]
    monkeypatch.setattr(sys, "argv", [str(word) for word in words])

    main()

    page = (tmp_path / "gallery.md").read_text(encoding="utf-8")
    assert "| `den:1` | 0.3 · 0.96 | 1.3 · 0.96 | 2.3 · 0.96 |\n| `den:2` | 0.3" in page
    assert page.endswith("![den](images/gallery-den.jpg)\n")
    sheet = np.asarray(Image.open(tmp_path / "images" / "gallery-den.jpg")).mean(axis=2)
    assert sheet.shape == (2 * 144, 6 * 256)
    assert sheet[::144, ::512] == pytest.approx(np.array([[20, 80, 140], [40, 100, 160]]), abs=3)


def test_a_run_of_fidelity_that_lacks_a_time_of_day_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gallery.md").write_text(PAGE, encoding="utf-8")
    row = {"environment": "den:1", "time": "day", "view": 0, "rmse": 1.0, "ssim": 0.9}
    (tmp_path / "figures.json").write_text(json.dumps([row]), encoding="utf-8")
    monkeypatch.setattr(
        sys, "argv", ["gallery", str(tmp_path / "figures.json"), str(tmp_path), "--docs", str(tmp_path)]
    )

    with pytest.raises(SystemExit, match="lacks den:1 evening, den:1 night: run fidelity with --times"):
        main()

    assert (tmp_path / "gallery.md").read_text(encoding="utf-8") == PAGE


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
