"""A batch that records frames, and what report and viewer make of them: nothing is said but by what was recorded."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from playwright.sync_api import Page, Route, expect

from benchbot_view.rows import id_of
from plugins.view.tests.conftest import serving
from tests.browser import violations
from tests.conftest import SAMPLE_PLUGIN
from tests.plugins.batch.conftest import Batches, batches, sources  # noqa: F401 - fixtures

pytestmark = pytest.mark.xdist_group("browser")
PLUGIN = """\
from pathlib import Path
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_robots():
    yield Path(__file__).parent / "robots"

@hookimpl
def benchbot_ground_truths():
    yield Path(__file__).parent / "ground_truths"
"""
CAMERA = {"frame": "camera", "width": 48, "height": 32, "fx": 24.0, "fy": 24.0, "cx": 24.0, "cy": 16.0}
OBJECTS = {
    "chair": ([1.5, 1.2, 0.5], [0.6, 0.6, 1.0]),
    "bottle": ([2.2, -1.2, 0.5], [0.3, 0.3, 1.0]),
    "person": ([0.0, -3.0, 0.5], [0.5, 0.5, 1.0]),  # behind the wall
}


def robot() -> str:
    """Return the sample robot, with all that is to be known of its camera."""
    path = Path(SAMPLE_PLUGIN) / "benchbot_sample" / "robots" / "sample_robot.yaml"
    frames = {"camera": {"xyz": [0, 0, 0.5], "rpy_deg": [-90, 0, -90]}, "lidar": {"xyz": [0, 0, 0]}}
    declared = {**yaml.safe_load(path.read_text("utf-8")), "name": "sample_eye", "frames": frames}
    return yaml.safe_dump({**declared, "camera": {**declared["camera"], **CAMERA}})


def truth() -> str:
    objects = [
        {"class": name, "ID_name": name, "isgroup": False, "centroid": centroid, "extent": extent}
        for name, (centroid, extent) in OBJECTS.items()
    ]
    found = {"objects": objects, "class_list": [*OBJECTS, "background"], "synonyms": {}}
    about = {"environment": {"name": "arena", "variant": 1}, "format": {"name": "object_map_ground_truth"}}
    return json.dumps({**about, "ground_truth": found})


def test_frames_of_a_batch_tell_report_and_viewer_what_was_seen(
    batches: Batches,  # noqa: F811
    make_plugin: Callable[..., Path],
    monkeypatch: pytest.MonkeyPatch,
    tab: Page,
    tmp_path: Path,
) -> None:
    make_plugin("sample-eye", PLUGIN, {"robots/eye.yaml": robot(), "ground_truths/1.json": truth()})
    words = ("--task", "sample:passive", "--robots", "sample_eye", "--envs", "arena:1", "--native", batches.solution)
    done = batches.cli(
        "batch", *words, "--jobs", "1", "--record", "frames,steps", "--evaluate-with", "omq", "-o", "night"
    )
    assert done.returncode == 0, done.stderr
    (result,) = batches.path("night").glob("episodes/*/result.json")
    kept = {path.name.partition(".")[2] for path in (result.parent / "frames").iterdir()}
    assert kept == {"jpg", "depth.png", "instances.png", "json"}

    report = (batches.path("night") / "report.html").read_text("utf-8")
    assert report.count("Not seen in any of 4 frames") == 1  # the person behind the wall
    assert "Distance of the nearest view" in report
    assert report.count('<img src="data:image/jpeg') >= 2  # chair and bottle, in the frames that saw them

    for name in ("BENCHBOT_STATE_DIR", "BENCHBOT_CACHE_DIR", "BENCHBOT_PLUGINS"):
        monkeypatch.setenv(name, batches.cli.variables[name])
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    with serving(batches.path("night")) as address:
        held: dict[str, Route] = {}
        tab.route("**/static/three.js", lambda route: held.update(library=route))
        tab.goto(address)
        tab.goto(f"{address.partition('?')[0]}episode/{id_of(result)}.html#pane=3d", wait_until="commit")
        expect(tab.locator("#now")).to_contain_text("2 of 3 objects seen")
        held["library"].continue_()  # when it is known what was seen, the place is drawn anew
        expect(tab.locator("#space-note")).to_contain_text("Drag to turn")
        seen = {name: tab.locator("tr[data-object]", has_text=name).locator(".seen") for name in OBJECTS}
        expect(seen["person"]).to_have_text("never")
        expect(seen["chair"]).to_contain_text("frame")
        for kind in ("depth", "classes"):
            expect(tab.locator(f"figure[data-kind={kind}]")).to_be_visible()
            expect(tab.locator(f"figure[data-kind={kind}].waiting")).to_have_count(0)
        expect(tab.locator("#breakdown")).to_contain_text("never seen")
        tab.locator("tr[data-object]", has_text="person").get_by_role("button").click()
        expect(tab.locator("#reel-title")).to_have_text("No frame saw this person: it was never in sight.")
        tab.keyboard.press("End")
        expect(tab.locator("#now")).to_contain_text("move_next")
        assert violations(tab) == []
