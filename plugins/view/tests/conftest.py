"""Results in miniroom:1 with pictures: one that is right but for two objects, and one that is empty; and a server."""

import json
import secrets
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from PIL import Image

from benchbot.plugin import Catalog, load_plugins
from benchbot_view.index import Index, Source
from benchbot_view.server import application, listener
from tests import conftest

assert conftest.SAMPLE_PLUGIN

ENVIRONMENT = "miniroom:1"
HOSTILE = "</script><img src=x onerror=alert(1)>\u202e"
MISSED = ("potted plant", "bottle")
Serve = Callable[[Path], str]


def truth() -> dict[str, Any]:
    catalog = Catalog(load_plugins())
    for path in catalog.ground_truth_files:
        document = json.loads(path.read_text("utf-8"))
        details = document["environment"]
        if f"{details['name']}:{details['variant']}" == ENVIRONMENT and "objects" in document["ground_truth"]:
            return dict(document["ground_truth"])
    raise AssertionError(ENVIRONMENT)


def result(solution: str, seed: int = 0, *, missed: tuple[str, ...] = (), **keys: Any) -> dict[str, Any]:
    true = truth()
    names = [*true["class_list"], *([] if "background" in true["class_list"] else ["background"])]
    found = [item for item in true["objects"] if item["class"] not in missed]
    objects = [
        {
            "label_probs": [float(name == item["class"]) for name in names],
            "centroid": item["centroid"],
            "extent": item["extent"],
        }
        for item in found
    ]
    rows = [[i, 0.5 * i, 1.2, 1.5 - 0.05 * i, -1.5708 + 0.25 * i] for i in range(6)]
    return {
        "task_details": {
            "name": "semantic_slam:passive:ground_truth",
            "results_format": "object_map",
            "localisation": "ground_truth",
        },
        "environment_details": [{"name": "miniroom", "variant": 1}],
        "results": {"objects": objects, "class_list": names},
        "provenance": {
            "benchbot": "0.1.0",
            "plugins": {},
            "selection": {"task": "t", "robot": "carter", "environment": ENVIRONMENT, "seed": seed},
            "solution": {"command": ["python", f"{solution}.py"], "files": {}},
            "steps": 5,
            "simulated_time_s": 2.5,
            "failure": None,
            "observation_digest": "00",
        },
        "track": [
            {
                "scene": ENVIRONMENT,
                "source": "simulation",
                "path_length_m": 0.3,
                "collisions": 0,
                "columns": ["observation", "time_s", "x_m", "y_m", "yaw_rad"],
                "rows": rows,
            }
        ],
        **keys,
    }


def save(path: Path, document: Mapping[str, Any], *, frames: int = 0) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document), "utf-8")
    for number in range(frames):
        folder = path.parent / f"{path.stem}-recordings" / "frames"
        folder.mkdir(parents=True, exist_ok=True)
        shade = (40 + 30 * number, 90, 200 - 30 * number)
        Image.new("RGB", (960, 540), shade).save(folder / f"{number:05d}.jpg", quality=40)
    return path


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("view") / "results"
    save(folder / "good" / "result.json", result("good", missed=MISSED), frames=6)
    save(folder / "poor" / "result.json", result("poor", missed=tuple(truth()["class_list"])), frames=6)
    failed = result(HOSTILE, 1)
    del failed["results"]
    failed["provenance"]["failure"] = {"class": "agent", "why": f"It said {HOSTILE}"}
    save(folder / "failed" / "result.json", failed)
    save(folder / "notes.json", {"no": "result"})
    return folder


@contextmanager
def serving(folder: Path, *, everything: bool = False) -> Iterator[str]:
    """Serve a folder in this process; yields the address with its token."""
    index = Index([Source.of(str(folder))], everything=everything)
    with listener(0) as bound:
        token, port = secrets.token_urlsafe(8), bound.getsockname()[1]
        bound.listen()
        server = uvicorn.Server(uvicorn.Config(application(index, folder.name, token, port), log_level="critical"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]})
        thread.start()
        try:
            while not server.started:
                time.sleep(0.02)
            yield f"http://127.0.0.1:{port}/?token={token}"
        finally:
            server.should_exit = True
            thread.join()


@pytest.fixture(scope="module")
def address(results: Path) -> Iterator[str]:
    with serving(results) as found:
        yield found
