"""The viewer as files: what they tell, and where they are written."""

import json
from pathlib import Path

import pytest

from benchbot.plugin import BenchbotError
from benchbot_view.export import write
from benchbot_view.index import Index, Source
from benchbot_view.pages import bundle, data, three
from benchbot_view.rows import id_of
from plugins.view.tests.conftest import HOSTILE, result, save


def exported(folder: Path, to: Path, **options: bool) -> Path:
    return write(Index([Source.of(str(folder))]), "results", to, **options).parent


def page_of(folder: Path, of: Path) -> str:
    return (of / "episode" / f"{id_of(folder)}.html").read_text("utf-8")


def test_ground_truth_is_not_published_unless_it_is_asked_for(results: Path, tmp_path: Path) -> None:
    good = results / "good" / "result.json"

    public = page_of(good, exported(results, tmp_path / "public"))
    whole = page_of(good, exported(results, tmp_path / "whole", with_ground_truth=True))

    for word in ('"truth_label":"potted plant"', "missed", "would give"):
        assert word in whole
        assert word not in public.replace('class="true missed"', "").replace("</svg>missed", "")
    assert '"true":[' not in public
    assert '"true":[' in whole
    index = (tmp_path / "public" / "index.html").read_text("utf-8")
    assert '"OMQ",0.' in index
    assert str(results) not in index + public


def test_true_poses_are_not_published_where_the_task_hides_them(tmp_path: Path) -> None:
    document = result("one")
    document["task_details"]["localisation"] = "noisy"
    path = save(tmp_path / "results" / "a.json", document, frames=2)

    page = page_of(path, exported(tmp_path / "results", tmp_path / "out"))

    assert '"base"' not in page
    assert '"path":[]' in page


def test_a_folder_with_something_else_in_it_is_left_alone(results: Path, tmp_path: Path) -> None:
    (tmp_path / "precious.txt").write_text("mine")
    with pytest.raises(BenchbotError, match="is not empty"):
        exported(results, tmp_path)
    out = exported(results, tmp_path / "out")
    assert exported(results, out) == out


def test_data_in_a_page_ends_no_block() -> None:
    text = str(data([HOSTILE, "<!--"]))
    assert not {"<", ">", "&"} & set(text)
    assert json.loads(text) == [HOSTILE, "<!--"]


def test_scripts_become_one_each() -> None:
    for entry in ("overview.js", "episode.js", "pair.js"):
        text = bundle(entry)
        assert "\nimport " not in text
        assert "\nexport " not in text
    assert bundle("episode.js").index("function make(") < bundle("episode.js").index("function showSpace(")


def test_trimesh_has_three_js_where_it_is_looked_for() -> None:
    assert b"Three.js Authors" in three()
    assert b"GLTFLoader extends" not in three()
