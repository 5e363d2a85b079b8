"""A box like Cornell's, and what Mitsuba 3 makes of it: the golden picture of our tests.

python -m benchmarks.rays.cornell FILE.npz [SAMPLES]

The room of Goral et al., "Modeling the interaction of light between diffuse surfaces", 1984, two metres wide, with a
glossy box besides the matt one. Surfaces are closed, so that no light gets behind them.
"""

import sys
import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import Material, SceneGeometry
from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from benchbot_sim_taichi.renderer import Intrinsics
from benchmarks.rays import mitsuba_scene
from benchmarks.rays.peers import mitsuba as peer
from benchmarks.rays.scene import Builder, box
from benchmarks.rays.workload import look

CAMERA = Intrinsics(64, 64, 90.0, 90.0, 32.0, 32.0)
POSE = look((-2.9, 1.0, 1.0), 0.0, 0.0)
SAMPLES = 4096
REFLECTIONS = 12
DARK = (0.0, 0.0, 0.0)
NIGHT = Lighting(sun=Sun(irradiance=DARK), sky=Sky(DARK, DARK, DARK), exposure=1.0)


def cornell() -> SceneGeometry:
    """White floor, ceiling and back, a red and a green wall, a lamp, a matt and a glossy box; open towards -x."""
    builder = Builder()
    white, red, green = (
        Material("white", (0.73,) * 3),
        Material("red", (0.63, 0.06, 0.05)),
        Material("green", (0.14, 0.45, 0.09)),
    )
    builder.add("floor", [box((-0.1, -0.1, -0.1), (2.1, 2.1, 0))], white)
    builder.add("ceiling", [box((-0.1, -0.1, 2), (2.1, 2.1, 2.1))], white)
    builder.add("back", [box((2, -0.1, 0), (2.1, 2.1, 2))], white)
    builder.add("right", [box((-0.1, -0.1, 0), (2, 0, 2))], green)
    builder.add("left", [box((-0.1, 2, 0), (2, 2.1, 2))], red)
    builder.add(
        "lamp", [box((0.75, 0.75, 1.96), (1.25, 1.25, 1.98))], Material("lamp", DARK, emission=(15.0, 13.0, 10.0))
    )
    builder.add("matt box", [box((1.1, 1.1, 0), (1.7, 1.7, 1.2))], white)
    builder.add(
        "glossy box",
        [box((0.4, 0.4, 0), (0.9, 0.9, 0.6))],
        Material("brass", (0.9, 0.7, 0.3), metallic=1.0, roughness=0.4),
    )
    return builder.finish()


def by_mitsuba(
    scene: SceneGeometry,
    lighting: Lighting | None,
    pose: npt.NDArray[np.float64],
    camera: Intrinsics,
    samples: int,
    reflections: int,
) -> npt.NDArray[np.float32]:
    """(H, W, 3) radiance, from Mitsuba's path integrator with the materials of glTF."""
    mi: Any = import_module(peer.MODULE)
    mi.set_variant("llvm_ad_rgb")
    with tempfile.TemporaryDirectory() as folder:
        loaded, _ = mitsuba_scene.load(scene, Path(folder), lighting=lighting, look=mitsuba_scene.gltf)
    # Its depth counts the edges of a path: one more than reflections, for the camera's.
    integrator = mi.load_dict({"type": "path", "max_depth": reflections + 1, "rr_depth": 100})
    sensor = mitsuba_scene.sensor(pose, camera)
    total = np.zeros((camera.height, camera.width, 3))
    at_once = min(samples, 256)
    for seed in range(samples // at_once):
        total += np.array(mi.render(loaded, sensor=sensor, integrator=integrator, spp=at_once, seed=seed))
    return (total / (samples // at_once)).astype(np.float32)


def main() -> None:
    mi: Any = import_module(peer.MODULE)
    samples = int(sys.argv[2]) if len(sys.argv) > 2 else SAMPLES
    radiance = by_mitsuba(cornell(), None, POSE, CAMERA, samples, REFLECTIONS)
    np.savez_compressed(sys.argv[1], radiance=radiance.astype(np.float16), mitsuba=mi.__version__, samples=samples)
    print(f"Mitsuba {mi.__version__}, {samples} samples a pixel, mean {radiance.mean(axis=(0, 1))}")


if __name__ == "__main__":
    main()
