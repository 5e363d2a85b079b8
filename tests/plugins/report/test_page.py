import base64
import io
import itertools
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from benchbot.core.records import Score
from benchbot.plugins.report.camera_pictures import frames_of
from benchbot.plugins.report.rendering import render
from tests.made_results import Make, Save
from tests.plugins.report.conftest import TRACK, Report, provenance
from tests.plugins.report.pages import Page

HOSTILE = "<script>document.title='hacked'</script><img src=x onerror=alert(1)>\"'{{ 7*7 }}"


def page(data: Any) -> Page:
    return Page(render(data, "html"))


def test_a_stranger_reads_what_was_measured_and_how_well_it_went(report: Report, results: list[Path]) -> None:
    shown = page(report(results))

    assert [heading.text for heading in shown.all("h1")] == ["my_mapper"]
    assert "semantic_slam:passive:ground_truth" in shown.text
    assert "4 times, in 2 environments (flat:1, flat:2)" in shown.text
    assert "on the robot carter_lowres (Carter with a 320 x 180 camera" in shown.text
    assert "Object map quality" in shown.text
    assert "results scored 3 of 4" in shown.text


def test_each_environment_has_a_bar_and_each_seed_a_dot(report: Report, results: list[Path]) -> None:
    data = report(results)
    shown = page(data)

    dots = [title.text for title in shown.all("title") if re.fullmatch(r"flat:\d, seed \d: .*", title.text)]
    assert len(dots) == 4 * 3  # by environment, by variant and by seed; there is but one place and one robot
    assert dots.count("flat:2, seed 1: missing, counted as zero") == 3
    assert {row.text.strip() for row in shown.all("th", scope="row")} >= {"flat:1", "flat:2", "1", "2", "0"}


def test_the_bar_of_an_environment_is_what_the_method_combines(report: Report, results: list[Path]) -> None:
    data = report(results)

    one, two = data.environments.values()
    assert data.combined(two)["OMQ"] == pytest.approx(0.5)  # one is perfect, one missing
    assert data.combined(one)["OMQ"] < 1
    left_out = report(results, missing="leave-out")
    assert left_out.combined(left_out.environments["flat:2"])["OMQ"] == 1.0
    assert "left out of the scores" in page(left_out).text


def test_failures_are_told_by_class_with_their_reasons(report: Report, results: list[Path]) -> None:
    text = page(report(results)).text

    assert "3 of 4 expected results were scored. 1 is missing and counted as zero in every score." in text
    assert re.search(r"collision 1 The robot hit something. flat:2, seed 0 \(scored all the same\): It touched", text)
    assert re.search(r"timeout 1 .* flat:2, seed 1: The episode failed: It took longer than 600 s\.", text)


def test_what_is_missing_or_broken_says_why(report: Report, results: list[Path], save: Save) -> None:
    text = page(report([*results, save("cut.json", "{")], required_envs=["flat:1", "flat:2", "flat:3"])).text

    assert "flat:3" in text
    assert "There is no result of this environment." in text
    assert "cut.json" in text


def test_objects_are_drawn_from_above_and_told_in_words(report: Report, results: list[Path]) -> None:
    shown = page(report(results))

    roles = [shape.attributes.get("class") for shape in shown.all("rect")]
    assert {"truth found", "proposal found", "truth missed", "proposal extra"} <= set(roles)
    assert shown.all("polyline", class_="path")
    assert "way of the robot" in shown.text
    assert "1.5 m" in shown.text
    words = [" ".join(row.text.split()) for row in shown.all("tr")]
    assert any(word.startswith("chair missed") for word in words)
    assert any(word.startswith("table not there table") for word in words)


def test_failures_are_shown_in_the_frame_that_sees_them_best(report: Report, results: list[Path], frames: Path) -> None:
    data = report(results)
    poor = next(episode for episode in data.episodes if episode.source and episode.source.endswith("poor.json"))
    assert [frame.path.name for frame in frames_of(poor, data)] == [f"{i:05d}.jpg" for i in range(5)]

    pictures = [image for image in page(data).all("img") if "box is outlined" in (image.attributes["alt"] or "")]

    assert [image.attributes["alt"] for image in pictures] == [
        "What the camera saw where chair stands and was missed; its box is outlined.",
        "What the camera saw where table was reported and is not there; its box is outlined.",
    ]
    head, _, encoded = (pictures[0].attributes["src"] or "").partition(",")
    assert head == "data:image/jpeg;base64"
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(encoded))))
    assert image.shape == (200, 300, 3)
    assert (image.max(axis=2) < 40).any()  # the outline's dark rim: the frame itself is nowhere so dark


@pytest.mark.parametrize("spoil", ["one too few", "not a picture", "another size"])
def test_frames_that_do_not_belong_or_cannot_be_read_are_not_shown(
    report: Report, results: list[Path], frames: Path, spoil: str
) -> None:
    if spoil == "one too few":
        (frames / "00004.jpg").unlink()
    for path in frames.glob("*.jpg"):
        if spoil == "not a picture":
            path.write_bytes(b"\xff\xd8 not much of a picture")
        elif spoil == "another size":
            Image.new("RGB", (8, 8)).save(path)

    shown = page(report(results))

    assert not [image for image in shown.all("img") if "outlined" in (image.attributes["alt"] or "")]
    assert "missed" in shown.text


def test_the_page_needs_nothing_but_itself(report: Report, results: list[Path], frames: Path) -> None:
    html = render(report(results), "html")
    shown = Page(html)

    policy = shown.all("meta", **{"http-equiv": "Content-Security-Policy"})[0].attributes["content"] or ""
    style = html[html.index("<style>") + len("<style>") : html.index("</style>")]
    expected = base64.b64encode(sha256(style.encode()).digest()).decode()
    assert policy.startswith("default-src 'none'")
    assert f"style-src 'sha256-{expected}'" in policy
    assert not shown.all("script")
    assert not shown.all("link")
    assert "style=" not in html.replace(style, "")
    assert "url(" not in style
    assert all((image.attributes["src"] or "").startswith("data:image/jpeg;base64,") for image in shown.all("img"))


def test_nothing_that_a_result_says_is_markup(report: Report, make_result: Make, save: Save) -> None:
    document = make_result(0.0, provenance=provenance(0, ("agent", HOSTILE), robot=HOSTILE), track=[TRACK])
    document["results"]["class_list"] = ["chair", HOSTILE, "background"]
    document["results"]["objects"].append(
        {"label_probs": [0.0, 1.0, 0.0], "centroid": [2.0, 1.0, 0.0], "extent": [1.0, 1.0, 1.0]}
    )
    document["task_details"] |= {"name": HOSTILE, "description": HOSTILE}
    document["provenance"]["solution"] = {"command": ["python", HOSTILE], "files": {HOSTILE: "00"}}
    document["provenance"]["plugins"] = {HOSTILE: {"version": HOSTILE, "sha256": HOSTILE}}
    other = make_result(0.0, provenance=provenance())
    other["environment_details"][0]["name"] = HOSTILE
    other["task_details"]["name"] = HOSTILE

    html = render(report([save("a.json", document), save("b.json", other)], name=HOSTILE), "html")

    shown = Page(html)
    assert not shown.all("script")
    assert not shown.all("img")
    assert "{{ 7*7 }}" in shown.text
    assert shown.all("h1")[0].text == HOSTILE


def test_the_same_results_give_the_same_bytes(report: Report, results: list[Path], frames: Path) -> None:
    assert render(report(results), "html") == render(report(list(results)), "html")


def test_headings_tables_and_pictures_can_be_told_by_ear(report: Report, results: list[Path], frames: Path) -> None:
    shown = page(report(results))

    levels = [int(element.tag[1]) for element in shown.elements if re.fullmatch(r"h[1-6]", element.tag)]
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))
    assert all(image.attributes.get("alt") for image in shown.all("img"))
    headers = [header for header in shown.all("th") if header.attributes.get("aria-hidden") != "true"]
    assert all(header.attributes.get("scope") in ("row", "col") for header in headers)
    ids = [element.attributes["id"] for element in shown.elements if "id" in element.attributes]
    assert len(ids) == len(set(ids))
    assert all((link.attributes["href"] or "")[1:] in ids for link in shown.all("a"))
    assert [len(shown.all(tag)) for tag in ("header", "nav", "main", "footer")] == [1, 1, 1, 1]


@pytest.mark.parametrize("number", [1e6, -1e6])
def test_absurd_numbers_break_no_map(report: Report, make_result: Make, save: Save, number: float) -> None:
    document = make_result(
        0.0, number, track=[{**TRACK, "rows": [[0, 0.0, number * 1e200, 0.0, 0.0], [1, 1.0, 0.0, 0.0, 0.0]]}]
    )

    html = render(report([save("a.json", document)]), "html")

    assert "1 more lie far outside of this map" in html
    assert not re.search(r'="-?(inf|nan)', html)


def test_a_result_of_v2_that_says_little_is_shown_all_the_same(
    report: Report, make_result: Make, save: Save, tmp_path: Path
) -> None:
    text = page(report([save("a.json", make_result())])).text

    assert "A solution was given the task" in text
    assert "The results do not say how long they took." in text


def test_an_interval_is_shown_where_there_is_one(report: Report, results: list[Path]) -> None:
    data = report(results)
    data.scores["intervals"] = {"OMQ": {"low": 0.25, "high": 0.75, "level": 0.9}}
    data.scores["statistics"] = {"method": "by places", "clusters": 7, "draws": 99, "seed": 3, "note": "A note."}

    text = page(data).text

    assert "90 % interval 0.25 to 0.75" in text
    assert "Another choice of 7 places like these" in text
    assert "90 in 100 hold the score" in text
    assert "by places, 99 draws, seed 3" in text
    assert "A note." in text


def test_of_many_environments_the_worst_of_each_place_is_open(report: Report, results: list[Path]) -> None:
    data = report(results[:2])
    good, poor = data.episodes
    names = [("flat", good), ("flat", poor), ("flat", good), ("loft", good), ("loft", good), ("loft", poor)]
    episodes = [replace(episode, environment=f"{place}:{i}") for i, (place, episode) in enumerate(names)]

    shown = page(replace(data, episodes=tuple(episodes)))

    environments = [heading.text for heading in shown.all("h4")]
    assert environments == ["flat:1", "flat:0", "flat:2", "loft:5", "loft:3", "loft:4"]
    folded = [summary.text for summary in shown.all("summary") if re.match(r"(flat|loft):\d: OMQ", summary.text)]
    assert [text.split(": ")[0] for text in folded] == ["flat:0", "flat:2", "loft:3", "loft:4"]
    assert shown.text.count("the one with the worst score is shown") == 2
    assert len(shown.all("tr", class_="next-place")) == 1


def test_where_nothing_failed_the_worst_that_was_found_is_shown(
    report: Report, make_result: Make, save: Save, tmp_path: Path
) -> None:
    shown = page(report([save("a.json", make_result(0.5, 3.0, provenance=provenance(), track=[TRACK]))]))

    worst, *others = shown.all("li", class_="weak")
    assert not others
    assert re.search(r"chair\s+found, box off, 0\.\d\d", worst.text)


def test_an_error_is_called_an_error_and_has_no_zero_for_what_is_missing(report: Report, results: list[Path]) -> None:
    def means(scores: Sequence[dict[str, float]]) -> dict[str, float]:
        known = [row["OMQ"] for row in scores if row]
        return {"OMQ": sum(known) / len(known)} if known else {}

    data = report(results)
    read_so = {"OMQ": Score(lower_is_better=True, least=0.0)}
    error = replace(data, evaluator=replace(data.evaluator, scores=read_so, combine=means))

    shown = page(error)

    assert "Less is better; 0 is the best there can be." in shown.text
    assert "OMQ ↓" in shown.text
    assert "1 is missing and counted as zero in every score but OMQ" in shown.text
    assert not shown.all("circle", class_="dot missing")
    assert "OMQ $\\downarrow$" in render(error, "tex")
    assert "| OMQ ↓ |" in render(error, "md")


def test_ten_environments_stay_small_enough_to_mail(
    report: Report, make_result: Make, save: Save, results: list[Path], frames: Path
) -> None:
    document = json.loads(results[1].read_text())
    objects = document["results"]["objects"]
    document["results"]["objects"] = [{**objects[-1], "centroid": [0.02 * i, 0.01 * i, 0.5]} for i in range(300)]
    html = render(report([save("a.json", document)]), "html")

    assert html.count('alt="What the camera saw where') <= 12
    assert "more are not listed" in html
    assert len(html.encode()) < 500_000


def test_the_diagnosis_of_a_real_robot_is_shown(report: Report, results: list[Path], save: Save) -> None:
    document = json.loads(results[0].read_text("utf-8"))
    findings = [
        {"level": "ok", "name": "graph", "text": "3 other nodes"},
        {"level": "broken", "name": "depth /depth", "text": "half of it is beyond 1800 m"},
    ]
    driver = {"middleware": "rmw_zenoh_cpp", "clocks": {"/odom": {"median_s": 0.1}}}
    del document["provenance"]["simulated_time_s"]
    robot = {"findings": findings, "despite": ["depth /depth"], "driver": driver}
    document["provenance"] |= {"robot_time_s": 71.5, "robot": robot}

    page = render(report([save("real.json", document)]), "html")

    assert "<code>broken: depth /depth: half of it is beyond 1800 m</code>" in page
    assert "<dt>overridden (--despite)</dt><dd><code>depth /depth</code>" in page
    assert "<code>middleware rmw_zenoh_cpp</code>" in page
    assert '<td class="number">71.5 s</td>' in page


def test_what_all_attempts_took_and_what_a_score_is_a_mean_of_is_said(
    report: Report, results: list[Path], save: Save
) -> None:
    document = json.loads(results[0].read_text("utf-8"))
    spent = {"steps": 31, "looks": 0, "restarts": 2, "collisions": 2, "path_length_m": 5.5, "simulated_time_s": 16.0}
    document["provenance"] |= {"restarts": 2, "spent": spent}
    again = [save("good.json", document), *results[1:]]

    page, text = (render(report(again, missing="leave-out"), kind) for kind in ("html", "md"))

    assert 'flat:1, seed 0, 3 attempts</th><td class="number">31</td>' in page
    assert "flat:1, seed 0: 3 attempts, 31 steps and 2 collisions in all" in page
    assert "mean of 3 of 4." in page
    assert "mean of 3 of 4." in text
