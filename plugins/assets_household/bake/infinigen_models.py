"""Make the models that `infinigen.toml` lists, and the catalogue entries of them (models/infinigen.json).

python -m plugins.assets_household.bake.infinigen_models --python PYTHON_WITH_INFINIGEN --work FOLDER [--only ID ...]

Baked pictures and shapes stay in the work folder, so that a change of size or front does not bake again.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from plugins.assets_household.bake.outward import outward
from plugins.assets_household.bake.parts import Floats, Part, load_parts
from plugins.assets_household.bake.recolour import recoloured
from plugins.assets_household.bake.standing import standing_places
from plugins.assets_household.bake.write_glb import write_glb
from tools.household.shrink import shrink

HERE = Path(__file__).parent
MODELS = HERE.parent / "src" / "benchbot_assets_household" / "models"
_BAKED_FROM = ("factory", "seed", "triangles", "texture_px", "surfaces", "drop", "drop_materials", "unwrap")
_TIME_LIMIT_S = 1200


def main() -> None:
    """Bake what is not baked yet, write the models and their entries."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--python", type=Path, required=True, help="the Python that has bpy and infinigen")
    parser.add_argument("--work", type=Path, required=True, help="where baked models are kept")
    parser.add_argument("--table", type=Path, default=HERE / "infinigen.toml")
    parser.add_argument("--models", type=Path, default=MODELS)
    parser.add_argument("--only", nargs="*", help="make these models again; the entries are those of all")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    arguments.models.mkdir(parents=True, exist_ok=True)
    entries = []
    for row in read_table(arguments.table):
        file = arguments.models / f"{row['id']}.glb"
        baked = bake(row, arguments.python, arguments.work)
        if baked is None:
            print(f"{row['id']}: not baked, see its log in {arguments.work}", file=sys.stderr, flush=True)
            continue
        parts = placed([outward(tinted(part, row)) for part in load_parts(baked)], row["turn_deg"], row["size_m"])
        if arguments.only is None or row["id"] in arguments.only or not file.exists():
            pixels = {"texture_px": row["texture_px"], "detail_px": row["texture_px"] // 2}
            glb = shrink(write_glb(row["id"], parts), **pixels, quality=row["quality"])
            file.write_bytes(glb)
            print(f"{row['id']}: {len(glb) // 1024} KB", flush=True)
        entries.append(entry(row, parts))
    (arguments.models / "infinigen.json").write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")


def read_table(path: Path) -> list[dict[str, Any]]:
    """The rows of the table, `[defaults]` filled in."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    return [table["defaults"] | row for row in table["model"]]


def bake(row: dict[str, Any], python: Path, work: Path) -> Path | None:
    """The baked archive of a row, made in a process of its own unless it is there; None when infinigen failed."""
    job = {key: row[key] for key in _BAKED_FROM if key in row}
    name = f"{row['id']}_{hashlib.sha256(json.dumps(job, sort_keys=True).encode()).hexdigest()[:8]}"
    archive, job_file = work / f"{name}.npz", work / f"{name}.json"
    if not archive.exists():
        job_file.write_text(json.dumps(job), encoding="utf-8")
        with (work / f"{name}.log").open("w", encoding="utf-8") as log:
            try:
                subprocess.run(
                    [python, "-m", "plugins.assets_household.bake.bake_model", job_file, archive],
                    cwd=HERE.parents[2],
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    check=True,
                    timeout=_TIME_LIMIT_S,
                )
            except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
                return None
    return archive


def tinted(part: Part, row: dict[str, Any]) -> Part:
    """The part with its base colour changed as the row's "recolour" says."""
    images = part.surface.images
    if "recolour" not in row or not images:
        return part
    base = recoloured(images["base_color"], **row["recolour"])
    return replace(part, surface=replace(part.surface, images=images | {"base_color": base}))


def placed(parts: list[Part], turn_deg: float, size_m: list[float]) -> list[Part]:
    """The parts with their front to +x, of the wanted size, the middle of the box's bottom at the origin.

    A size of 0 keeps the proportion to the others; all zeros keep the asset's own size.
    """
    turn = np.deg2rad(turn_deg)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    low, high = box([part.positions @ rotation.T for part in parts])
    wanted = np.array(size_m, np.float64)
    scale = np.where(wanted > 0, wanted / (high - low), 0.0)
    scale = np.where(scale > 0, scale, scale[scale > 0].mean() if scale.any() else 1.0)
    origin = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    moved = []
    for part in parts:
        normals = part.normals @ rotation.T / scale
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        moved.append(Part((part.positions @ rotation.T - origin) * scale, normals, part.uvs, part.surface))
    return moved


def box(positions: list[Floats]) -> tuple[Floats, Floats]:
    """The least and the greatest coordinates."""
    return np.min([p.min(axis=0) for p in positions], axis=0), np.max([p.max(axis=0) for p in positions], axis=0)


def entry(row: dict[str, Any], parts: list[Part]) -> dict[str, Any]:
    """The model's entry in the catalogue."""
    low, high = box([part.positions for part in parts])
    corners = np.concatenate([part.positions for part in parts])
    return {
        "id": row["id"],
        "file": f"models/{row['id']}.glb",
        "class": row["class"] or None,
        "kind": row["kind"],
        "placement": row["placement"],
        "size_m": [round(float(side), 4) for side in high - low],
        "surfaces": standing_places(corners.reshape(-1, 3, 3)) if row["stand_on"] else [],
        "group": row["group"],
        "triangles": len(corners) // 3,
        "licence": "BSD-3-Clause",
        "author": f"Infinigen 1.15.5 (Princeton Vision & Learning Lab), seed {row['seed']}",
        "source": f"infinigen.assets.objects.{row['factory']}",
    }


if __name__ == "__main__":
    main()
