from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
import pytest
import yaml
from numpy.typing import NDArray

_COMPONENTS = {pygltflib.FLOAT: np.float32, pygltflib.UNSIGNED_SHORT: np.uint16, pygltflib.UNSIGNED_INT: np.uint32}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


@dataclass(frozen=True)
class Node:
    """An object of a scene file, in the map frame."""

    name: str
    tag: dict[str, Any]
    vertices: NDArray[np.float64]
    triangles: NDArray[np.int_]

    @property
    def low(self) -> NDArray[np.float64]:
        low: NDArray[np.float64] = self.vertices.min(axis=0)
        return low

    @property
    def high(self) -> NDArray[np.float64]:
        high: NDArray[np.float64] = self.vertices.max(axis=0)
        return high


def _read_nodes(path: Path) -> dict[str, Node]:
    """Every node's geometry, turned from glTF's (x, y, z) to the map frame's (x, -z, y)."""
    document = pygltflib.GLTF2().load(str(path))
    blob = document.binary_blob()

    def read(index: int) -> NDArray[Any]:
        accessor = document.accessors[index]
        view = document.bufferViews[accessor.bufferView]
        kind, width = _COMPONENTS[accessor.componentType], _WIDTHS[accessor.type]
        return np.frombuffer(blob, kind, accessor.count * width, view.byteOffset).reshape(-1, width)

    nodes = {}
    for node in document.nodes:
        vertices, triangles, offset = [], [], 0
        for primitive in document.meshes[node.mesh].primitives:
            points = read(primitive.attributes.POSITION).astype(float)
            vertices.append(points[:, [0, 2, 1]] * [1, -1, 1])
            triangles.append(read(primitive.indices).reshape(-1, 3).astype(int) + offset)
            offset += len(points)
        tag = node.extras["benchbot"]
        nodes[node.name] = Node(node.name, tag, np.concatenate(vertices), np.concatenate(triangles))
    return nodes


def package_file(*parts: str) -> Path:
    return Path(str(files("benchbot_envs_bear").joinpath(*parts)))


@pytest.fixture(scope="session")
def scene_path() -> Path:
    return package_file("scenes", "miniroom_1.glb")


@pytest.fixture(scope="session")
def read_nodes() -> Callable[[Path], dict[str, Node]]:
    return _read_nodes


@pytest.fixture(scope="session")
def nodes(scene_path: Path) -> dict[str, Node]:
    return _read_nodes(scene_path)


@pytest.fixture(scope="session")
def environment() -> dict[str, Any]:
    declaration: dict[str, Any] = yaml.safe_load(
        package_file("environments", "miniroom_1.yaml").read_text(encoding="utf-8")
    )
    return declaration


@pytest.fixture(scope="session")
def truth() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(package_file("ground_truths", "miniroom_1.json").read_text(encoding="utf-8"))
    return document


@pytest.fixture(scope="session")
def published() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(package_file("published", "miniroom_1.json").read_text(encoding="utf-8"))
    return document
