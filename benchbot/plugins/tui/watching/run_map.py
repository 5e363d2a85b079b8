"""What the map of a run shows just now."""

from benchbot.plugins.tui.watching.map_window import MapContent, cleaned, endpoints
from benchbot.plugins.tui.watching.scenery import Scenery
from benchbot.plugins.watching.views import RunView

SCANNERS = ("laser", "lidar", "base_link")
"""The frames that a laser may be read in, and the one that it is near at least."""
ZOOMS = (1.0, 1.5, 2.0, 3.0, 5.0, 8.0)


def content(view: RunView, scenery: Scenery, zoom: int, *, truth: bool) -> tuple[MapContent, object]:
    """Return the map of a view, and a key that is equal for maps that look the same; `zoom` is a place in ZOOMS."""
    place, true_boxes = scenery.place(environment(view))
    pose = view.progress.get("pose_xyyaw")
    pose_xyyaw = None if pose is None else (float(pose[0]), float(pose[1]), float(pose[2]))
    laser = None
    if view.look is not None and view.look.laser is not None and pose_xyyaw is not None:
        scans = view.look.laser
        seen_from = _scanner(view) or pose_xyyaw
        laser = endpoints(scans["scans"], float(scans.get("range_max", float("inf"))), seen_from)
    boxes = scenery.boxes(view.result)
    shown = MapContent(
        place=place,
        pose_xyyaw=pose_xyyaw,
        path=view.path,
        laser=laser,
        boxes=boxes,
        truth=true_boxes if truth else (),
        zoom=ZOOMS[zoom],
    )
    shown = cleaned(shown)
    number = None if view.look is None else view.look.number
    return shown, (id(place), pose_xyyaw, view.path, number, boxes, shown.truth, zoom)


def environment(view: RunView) -> str:
    """Return the environment of the scene that the run is in."""
    scenes = view.session.get("environments") or ()
    number = int(view.progress.get("scene_number", 0))
    if number < len(scenes):
        return f"{scenes[number].get('name')}:{scenes[number].get('variant')}"
    return ":".join(view.state.environment.split(":")[:2])


def _scanner(view: RunView) -> tuple[float, float, float] | None:
    """Return where the laser was when it was read, which the robot may have left; None where the task hides it."""
    poses = None if view.look is None else view.look.poses
    if not poses or view.session.get("task", {}).get("localisation") == "noisy":
        return None
    pose = next((poses[frame] for frame in SCANNERS if frame in poses), None)
    if pose is None:
        return None
    x, y = pose["translation_xyz"][:2]
    return float(x), float(y), float(pose["rotation_rpy"][2])
