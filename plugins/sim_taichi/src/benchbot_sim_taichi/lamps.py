"""The lamps of a scene as its lighting has them: which ones are on, of what colour, how bright."""

from dataclasses import dataclass, replace

import numpy as np

from benchbot.plugin import BenchbotError, did_you_mean
from benchbot_scenes.scene import Material, SceneGeometry
from benchbot_sim_taichi.colorimetry import LUMINANCE, planckian


@dataclass(frozen=True)
class Lamps:
    """`on`: all (None), or the instances of these names; `temperature_k` None leaves each lamp its own colour."""

    on: tuple[str, ...] | None = None
    temperature_k: float | None = None
    scale: float = 1.0


def names(scene: SceneGeometry) -> list[str]:
    """Names of the instances that glow when switched on."""
    glows = np.array([material.is_emissive for material in scene.materials], bool)[scene.triangle_material]
    lit = {int(index) for index in np.unique(scene.triangle_instance[glows])}
    return sorted({instance.name for instance in scene.instances if instance.index in lit})


def check(scene: SceneGeometry, lamps: Lamps) -> None:
    """Raise BenchbotError when a lamp is named that the scene does not have."""
    there = names(scene)
    for place, name in enumerate(lamps.on or ()):
        if name not in there:
            raise BenchbotError(
                f"lighting.lamps.on[{place}] names a lamp that is not there: {name!r}",
                f"The scene's lamps are: {', '.join(there) or 'none'}.",
                f"Name one of them, or write 'all' or 'none'.{did_you_mean(name, there)}",
            )


def switched(scene: SceneGeometry, lamps: Lamps) -> SceneGeometry:
    """Return the scene with its lamps as declared; raises BenchbotError as `check` does."""
    check(scene, lamps)
    if lamps == Lamps():
        return scene
    materials = tuple(_tuned(material, lamps) for material in scene.materials)
    if lamps.on is None:
        return replace(scene, materials=materials)
    # Lamps that are off share their materials with those that are on: each material gets a dark twin.
    dark = tuple(replace(material, emission=(0.0, 0.0, 0.0), emission_image=None) for material in scene.materials)
    off = [instance.index for instance in scene.instances if instance.name not in lamps.on]
    is_off = np.isin(scene.triangle_instance, off)
    glows = np.array([material.is_emissive for material in scene.materials], bool)[scene.triangle_material]
    material = np.where(is_off & glows, scene.triangle_material + len(materials), scene.triangle_material)
    return replace(scene, materials=(*materials, *dark), triangle_material=material.astype(np.int32))


def _tuned(material: Material, lamps: Lamps) -> Material:
    emission = np.array(material.emission) * lamps.scale
    if lamps.temperature_k is not None:
        emission = LUMINANCE @ emission * planckian(lamps.temperature_k)
    red, green, blue = (float(channel) for channel in emission)
    return replace(material, emission=(red, green, blue))
