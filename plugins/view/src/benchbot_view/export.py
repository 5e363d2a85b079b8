"""The viewer as files: pages that need no server, and tell nothing that solutions may not know unless asked to."""

import shutil
from pathlib import Path
from typing import Any

import msgspec

from benchbot.plugin import BenchbotError
from benchbot_view import pages
from benchbot_view.episode import Episode, catalog, load
from benchbot_view.evidence import prepare, prepared
from benchbot_view.index import Index
from benchbot_view.rows import Row
from benchbot_view.scoring import MOST, Scorer, scores_of, together
from benchbot_view.server import KINDS, about, picture_of

MARK = ".benchbot-view"
"""A file in each folder that was written here: only such a folder is written again."""
ENTRIES = ("overview.js", "episode.js", "pair.js")


def write(
    index: Index,
    title: str,
    folder: Path,
    *,
    with_ground_truth: bool = False,
    with_hidden: bool = False,
) -> Path:
    """Write all episodes into a folder; return its first page.

    Raises BenchbotError for a folder in which something else lies, and for one that cannot be written.
    """
    _check(folder)
    index.look()
    _score(index)
    known = catalog()
    rows: list[Row] = []
    try:
        for row in index.rows()[2]:
            path = index.path(row.id)
            if path is None:
                continue
            try:
                episode = load(path, known, with_truth=with_ground_truth)
            except BenchbotError as error:
                rows.append(msgspec.structs.replace(row, state="unreadable", why=error.title))
                continue
            if episode.is_hidden and not with_hidden:
                continue
            rows.append(row)
            _write_episode(folder, row, episode)
        _write_rest(folder, title, rows)
    except OSError as error:
        raise BenchbotError(
            f"{folder} cannot be written.", f"{error.strerror}: {error.filename}.", "Choose another folder."
        ) from error
    index.close()
    return folder / "index.html"


def _check(folder: Path) -> None:
    if not folder.exists() or not any(folder.iterdir()):
        folder.mkdir(parents=True, exist_ok=True)
    elif not (folder / MARK).is_file():
        raise BenchbotError(
            f"{folder} is not empty.", "What lies in it was not written by benchbot view.", "Name a new folder."
        )
    else:
        for name in ("episode", "picture", "static"):
            shutil.rmtree(folder / name, ignore_errors=True)
    (folder / MARK).touch()


def _score(index: Index) -> None:
    """Score what has no score yet, here and now."""
    scorer = Scorer(index)
    scorer.recall()
    while waiting := index.unscored():
        batch = together(waiting, MOST)
        for (id_, _), (name, value) in zip(batch, scores_of([path for _, path in batch]), strict=True):
            index.put_score(id_, name, value)


def _write_episode(folder: Path, row: Row, episode: Episode) -> None:
    evidence = prepared(episode.recorded, episode.looked) or prepare(episode.recorded, episode.view, episode.looked)
    cloud_file = episode.folder / "cloud.json"
    # Without poses, the cloud and what each frame saw would give them away.
    knows_poses = any("base" in frame for frame in episode.document["frames"])
    evidence = episode.told(evidence)
    if not knows_poses:
        evidence = {**evidence, "seen": [], "objects": [], "breakdown": [], "cloud": False}
    cloud: Any = msgspec.Raw(cloud_file.read_bytes()) if evidence["cloud"] and cloud_file.is_file() else None
    document = {**about(row), **episode.document, "id": row.id}
    text = pages.page("episode.html", is_static=True, root="../", episode=document, evidence=evidence, cloud=cloud)
    _text(folder / "episode" / f"{row.id}.html", text)
    for frame in evidence["frames"]:
        for kind, (ending, _) in KINDS.items():
            picture = picture_of(episode, kind, frame["number"])
            if picture is not None:
                place = folder / "picture" / row.id / kind / f"{frame['number']:05d}{ending}"
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(picture, place)


def _write_rest(folder: Path, title: str, rows: list[Row]) -> None:
    table = {"revision": 0, "total": len(rows), "unscored": 0, "batches": [], "rows": rows}
    _text(folder / "index.html", pages.page("index.html", is_static=True, title=title, rows=table))
    _text(folder / "side-by-side.html", pages.page("pair.html", is_static=True, title="Side by side"))
    _text(folder / "static" / "style.css", pages.style())
    for entry in ENTRIES:
        _text(folder / "static" / entry, pages.bundle(entry))
    (folder / "static" / "three.js").write_bytes(pages.three())


def _text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")
