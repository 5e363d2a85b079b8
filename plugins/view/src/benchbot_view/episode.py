"""One episode as its page shows it: plain data for the template and for the scripts."""

import base64
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError, Catalog, load_plugins, read_result
from benchbot.viewing import (
    BREAKDOWNS,
    ENDINGS,
    LIGHT,
    MEANINGS,
    Box,
    Camera,
    MapObject,
    ReportedEpisode,
    breakdown,
    end_of,
    gather,
    installed_map,
    line_of,
    occupancy_of,
    one_line,
    scene_of,
    score_files,
)
from benchbot_view.cloud import matrix
from benchbot_view.evidence import Looked, Recorded, View, folder_of, recorded, recordings_of

Document = dict[str, Any]
MOST_LOG_BYTES = 256 * 1024
MOST_POINTS = 1500
MARGIN_M = 0.4
OUTCOMES = {"match": "found", "false_negative": "missed", "false_positive": "not there", "ignored": "ignored"}
_ACTION = "Sending action "


@dataclass(frozen=True)
class Episode:
    """An episode: what its page shows, and what its recording is looked at with."""

    document: Document
    recorded: Recorded
    view: View
    looked: Sequence[Looked]
    """The objects of the document, as they are looked for."""
    explained: Sequence[MapObject]
    is_hidden: bool
    """Whether its environment is one that solutions must not know."""

    def told(self, evidence: Document) -> Document:
        """Return what a recording shows, with how well objects were found by how they were seen."""
        seen = evidence.get("objects") or []
        rows = [
            {
                "verdict": item.verdict,
                "factors": {"overall": item.quality},
                "truth_extent": None if item.true is None else item.true.extent,
                **({"evidence": seen[number]} if seen else {}),
            }
            for number, item in enumerate(self.explained)
            if item.true is not None
        ]
        return {**evidence, "breakdown": _breakdown(breakdown(rows))}

    @property
    def folder(self) -> Path:
        """The folder of the cache for what is worked out of its recording."""
        return folder_of(self.recorded, self.looked)


def catalog() -> Catalog:
    """Return the catalog of what is installed."""
    return Catalog(load_plugins())


def load(path: Path, known: Catalog, *, with_truth: bool = True) -> Episode:
    """Return the episode of a result; without truth, nothing of it tells what solutions may not know.

    Raises BenchbotError for a file that is no result.
    """
    shown, why = _scored(path, known)
    declared = [known.find("environments", name) for name in _scenes(shown)]
    robot = known.find("robots", shown.robot or "")
    camera = None if robot is None else Camera.of(robot.data)
    if not with_truth:
        shown = _public(shown)
    paths = shown.paths
    objects = shown.objects
    may_hide = [scene_of(name, _true_boxes(objects, place), known) for place, name in enumerate(_scenes(shown))]
    view = View(camera, [(scene, pose) for scene, path_ in enumerate(paths) for pose in path_.observed], may_hide)
    found = recorded(path)
    document: Document = {
        "environment": one_line(shown.environment),
        "task": one_line(str((shown.document or {}).get("task_details", {}).get("name", ""))),
        "robot": one_line(shown.robot or ""),
        "failure": one_line(shown.failure or ""),
        "why": one_line(shown.reason or why),
        "scores": [[one_line(name), value] for name, value in (shown.scores or {}).items()],
        "diagnosis": _diagnosis(shown.diagnosis),
        "camera": _camera(camera),
        "scenes": [
            _scene(name, declared[place], paths[place] if place < len(paths) else None, shown, objects, place)
            for place, name in enumerate(_scenes(shown))
        ],
        "objects": [object_of(number, item) for number, item in enumerate(objects)],
        "frames": _frames(view, shown, path, found),
        "pictured": sorted(found.frames),
        "log": _log(path),
    }
    looked = [Looked(item.scene, item.true, item.estimated) for item in objects]
    hidden = any(each is not None and each.data.get("hidden") for each in declared)
    return Episode(document, found, view, looked, objects, hidden)


def _scored(path: Path, known: Catalog) -> tuple[ReportedEpisode, str]:
    """Return the episode, and why there is no score."""
    try:
        evaluation = score_files([path], catalog=known)
        (shown,) = gather(evaluation, [path], catalog=known, with_evidence=False).episodes
        return shown, ""
    except BenchbotError as error:
        return _unscored(path, known), f"{error.title} {error.why}"


def _unscored(path: Path, known: Catalog) -> ReportedEpisode:
    document = read_result(path)
    provenance = document.get("provenance") or {}
    selection = provenance.get("selection") or {}
    failure = provenance.get("failure") or {}
    scenes = document["environment_details"]
    name = ":".join([str(scenes[0]["name"]), *(str(scene["variant"]) for scene in scenes)])
    shown = ReportedEpisode(
        name,
        selection.get("seed"),
        selection.get("repeat"),
        None,
        selection.get("robot"),
        str(path),
        None,
        failure=failure.get("class"),
        reason=failure.get("why"),
        document=document,
    )
    truths: list[Any] = []
    for scene in _scenes(shown):
        with suppress(BenchbotError):
            true = [_as_truth(item) for item in installed_map(known, scene).objects if item.true is not None]
            truths.append({"ground_truth": {"objects": true}})
    return replace(shown, truths=tuple(truths))


def _as_truth(item: MapObject) -> Document:
    box = item.true
    assert box is not None  # noqa: S101 - as it was chosen
    return {"class": item.truth_label, "centroid": list(box.centroid), "extent": list(box.extent)}


def _true_boxes(objects: Sequence[MapObject], scene: int) -> list[Document]:
    boxes = [item.true for item in objects if item.scene == scene and item.true is not None]
    return [{"truth_centroid": box.centroid, "truth_extent": box.extent} for box in boxes]


def _scenes(shown: ReportedEpisode) -> list[str]:
    return [f"{scene.get('name')}:{scene.get('variant')}" for scene in shown.scenes]


def _public(shown: ReportedEpisode) -> ReportedEpisode:
    """Return an episode with nothing in it that the solution was not told, or has not said."""
    document = dict(shown.document or {})
    if document.get("task_details", {}).get("localisation") != "ground_truth":
        document = {key: value for key, value in document.items() if key != "track"}
        document["environment_details"] = [
            {key: value for key, value in scene.items() if key not in ("start_pose", "trajectory_poses")}
            for scene in shown.scenes
        ]
    goal = shown.goal if "position" in (shown.goal or {}) else None
    return replace(shown, document=document, truths=(), explanation=(), diagnosis={}, recorded={}, goal=goal)


def _camera(camera: Camera | None) -> Document | None:
    if camera is None:
        return None
    return {name: getattr(camera, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}


def _scene(
    name: str, declared: Any, path: Any, shown: ReportedEpisode, objects: Sequence[MapObject], place: int
) -> Document:
    """Return the map of a scene: its extent in metres, floor, walls, path and goals."""
    occupancy = occupancy_of(declared)
    points = [] if path is None else list(path.points)
    if len(points) > MOST_POINTS:
        points = [*points[:: len(points) // MOST_POINTS + 1], points[-1]]
    goals = list(shown.goals)
    boxes = [item.true for item in objects if item.scene == place and item.true is not None]
    corners = [*points, *goals, *(corner for box in boxes for corner in (box.low, box.high))]
    corners += [] if occupancy is None else [occupancy.low, occupancy.high]
    if not corners:
        found = [item.estimated for item in objects if item.estimated is not None]
        corners = [corner for box in found for corner in (box.low, box.high)] or [(-1.0, -1.0), (1.0, 1.0)]
    xs, ys = [float(x) for x, *_ in corners], [float(y) for _, y, *_ in corners]
    walls = None
    if occupancy is not None:
        picture = base64.b64encode(occupancy.png(LIGHT.wall)).decode()
        walls = {"low": list(occupancy.low), "high": list(occupancy.high), "href": f"data:image/png;base64,{picture}"}
    return {
        "name": one_line(name),
        "low": [min(xs) - MARGIN_M, min(ys) - MARGIN_M],
        "high": [max(xs) + MARGIN_M, max(ys) + MARGIN_M],
        "walls": walls,
        "path": [[round(x, 3), round(y, 3)] for x, y in points],
        "is_recorded": bool(path is not None and path.recorded),
        "collisions": None if path is None else path.collisions,
        "path_length_m": None if path is None else path.path_length_m,
        "goals": [[x, y] for x, y in goals],
    }


def object_of(number: int, item: MapObject) -> Document:
    """Return an object as pages show it; boxes are centre and size, x, y, z in metres."""
    return {
        "number": number,
        "scene": item.scene,
        "label": one_line(item.label or ""),
        "truth_label": None if item.truth_label is None else one_line(item.truth_label),
        "outcome": OUTCOMES.get(item.verdict or "", "there" if item.true is not None else "estimate"),
        "quality": item.quality,
        "why": one_line(item.why),
        "error": item.error,
        "probability": None if item.probability is None else round(item.probability, 3),
        "taken_for": None if item.mistaken is None else one_line(item.mistaken.label or item.mistaken.name),
        "true": _box(item.true),
        "estimated": _box(item.estimated),
    }


def _box(box: Box | None) -> list[float] | None:
    return None if box is None else [round(float(value), 4) for value in (*box.centroid, *box.extent)]


def _diagnosis(found: Document) -> Document | None:
    if not found:
        return None
    errors = [
        {
            "kind": one_line(str(error["kind"])),
            "meaning": MEANINGS.get(error["kind"], ""),
            "count": error["count"],
            "gain": error["gain"],
        }
        for error in found.get("errors", ())
    ]
    hints = [one_line(str(hint)) for hint in found.get("hints", ())]
    ending = found.get("ending")
    return {
        "errors": errors,
        "has_errors": "errors" in found,
        "hints": hints,
        "confusion": _confusion(found.get("confusion", ())),
        "states": _confusion(found.get("states", ())),
        "breakdown": _breakdown(found.get("breakdown", ())),
        "ending": ending
        and {**ending, "kind": ENDINGS.get(ending["kind"], ending["kind"]), "why": one_line(ending["why"])},
        "drift": list(found.get("drift", ())),
        "along": _along(found.get("along", ())),
    }


def _breakdown(found: Sequence[Document]) -> list[Document]:
    return [{"by": BREAKDOWNS.get(each["by"], each["by"]), "groups": each["groups"]} for each in found]


def _along(found: Sequence[Sequence[float]]) -> Document | None:
    """Return the error along the way as a line of 300 times 80, and what its ends are."""
    if len(found) < 2:
        return None
    far_m, most_m = max(found[-1][0], 1e-9), max(1e-9, *(row[1] for row in found))
    points = " ".join(f"{300 * x / far_m:.1f},{80 - 76 * y / most_m:.1f}" for x, y in found)
    return {"points": points, "far_m": far_m, "most_m": most_m}


def _confusion(rows: Sequence[Mapping[str, Any]]) -> Document:
    """Return the matrix of true and estimated classes, those that occur."""
    names = sorted({name for row in rows for name, value in row["estimated"].items() if value >= 0.005})
    return {
        "classes": [one_line(name) for name in names],
        "rows": [
            {
                "truth": "nothing there" if row["truth"] is None else one_line(str(row["truth"])),
                "missed": row["missed"],
                "estimated": [round(row["estimated"].get(name, 0.0), 2) for name in names],
                "right": names.index(row["truth"]) if row["truth"] in names else None,
            }
            for row in rows
        ],
    }


def _frames(view: View, shown: ReportedEpisode, path: Path, found: Recorded) -> list[Document]:
    """Return each observation: where the camera was, when, what was done before it and how that ended."""
    times = _times(shown)
    steps = _steps(path)
    count = max(len(view.bases), len(steps), max(found.frames, default=-1) + 1)
    frames = []
    for number in range(count):
        frame: Document = {"scene": view.bases[number][0] if number < len(view.bases) else 0}
        if number < len(view.bases):
            base = view.bases[number][1]
            x, y, _ = base.translation_xyz
            frame["base"] = [round(x, 4), round(y, 4), round(base.yaw_rad, 5)]
            if view.camera is not None:
                frame["camera"] = _pose(base @ view.camera.mount)
        if number < len(times):
            frame["time_s"] = times[number]
        if number < len(steps):
            step = steps[number]
            time_s = step.get("simulated_time_s", step.get("robot_time_s"))
            frame |= {"time_s": time_s} if isinstance(time_s, int | float) else {}
            frame |= {
                key: one_line(str(step[key])) for key in ("action", "outcome", "failure") if step.get(key) is not None
            }
            arguments = step.get("arguments")
            if isinstance(arguments, dict) and arguments:
                named = [
                    f"{one_line(str(key))} {value:g}"
                    for key, value in arguments.items()
                    if isinstance(value, int | float)
                ]
                frame["action"] = f"{frame.get('action', '')} {', '.join(named)}"
        frames.append(frame)
    return frames


def _pose(pose: Any) -> list[float]:
    """Return the rotation (row by row) and the translation of a pose: what is before the camera has a positive z."""
    rotation, translation = matrix(pose)
    return [round(float(value), 6) for value in (*rotation.ravel(), *translation)]


def _times(shown: ReportedEpisode) -> list[float]:
    times = []
    for track in (shown.document or {}).get("track") or ():
        number, time_s = (track["columns"].index(name) for name in ("observation", "time_s"))
        times += [float(row[time_s]) for row in track["rows"] if row[number] is not None]
    return times


def _steps(path: Path) -> list[Document]:
    """Return the lines of the recorder `steps`."""
    for folder in recordings_of(path, "steps"):
        steps = []
        with suppress(OSError):
            for line in (folder / "steps.jsonl").read_text("utf-8").splitlines():
                with suppress(ValueError):
                    found = json.loads(line)
                    steps += [found] if isinstance(found, dict) else []
            return steps
    return []


def _log(path: Path) -> list[Document]:
    """Return the solution's output: each line, and the number of the observation after which it was printed."""
    for file in (path.parent / "log.txt", path.with_suffix(".log"), path.parent / "solution.log"):
        with suppress(OSError):
            lines, number = [], 0
            for text in end_of(file, MOST_LOG_BYTES).splitlines():
                line = line_of("solution", text)
                lines.append({"text": line.text, "level": line.level, "frame": number})
                number += text.startswith(_ACTION)
            return lines
    return []
