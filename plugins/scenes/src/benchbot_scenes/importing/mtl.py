"""Material libraries of OBJ files (MTL), with the physically based keywords that Blender writes (Pr, Pm, norm)."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from benchbot_scenes.importing.files import Folder, decode_texture
from benchbot_scenes.scene import ImageArray, Material

UNKNOWN = Material(name="unknown", base_color=(0.6, 0.6, 0.6), roughness=0.9, double_sided=True)
PAINTED = Material(name="painted", base_color=(1.0, 1.0, 1.0), roughness=0.9, double_sided=True)
PAINTED_NUMBER = 1
CLEAR_BELOW = 0.5
# Kd multiplies the picture; a picture in black is what exporters write who do not know that.
BLACK = 0.02
# How many words follow an option of a map (MTL manual).
_OPTIONS = {"-s": 3, "-o": 3, "-t": 3, "-mm": 2, "-bm": 1, "-blendu": 1, "-blendv": 1, "-clamp": 1, "-cc": 1}
_OPTIONS |= {"-texres": 1, "-imfchan": 1, "-boost": 1, "-type": 1, "-colorspace": 1}


@dataclass
class Library:
    """Materials by name, with the images that they use."""

    materials: list[Material] = field(default_factory=lambda: [UNKNOWN, PAINTED])
    images: list[ImageArray] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _numbers: dict[str, int] = field(default_factory=dict)
    _image_numbers: dict[str, int | None] = field(default_factory=dict)

    def index(self, name: str) -> int:
        """Return the index of the material of a name; one that no library describes is grey."""
        return self._numbers.get(name, 0)

    def is_textured(self, number: int) -> bool:
        """Return whether a material's colour comes from a texture."""
        return self.materials[number].base_color_image is not None

    def add(self, material: Material) -> None:
        """Add a material; it replaces an earlier one of the same name."""
        self._numbers[material.name] = len(self.materials)
        self.materials.append(material)

    def image(self, name: str, folder: Folder) -> int | None:
        """Return the index of a texture, None if it does not exist or is not an image."""
        if name not in self._image_numbers:
            self._image_numbers[name] = decode_texture(folder.read_texture(name), name, self.images, self.notes)
        return self._image_numbers[name]


def read(names: Iterable[str], folder: Folder) -> Library:
    """Read libraries that lie beside a scene; those that are missing are noted."""
    library = Library()
    for name in dict.fromkeys(names):
        found = folder.find(name)
        if found is None:
            library.notes.append(f"The material library {name} is not there; what it describes is grey.")
            continue
        for described in _described(folder.read(name).decode("utf-8", errors="replace")):
            library.add(_material(described, library, folder))
    return library


def _described(text: str) -> list[dict[str, str]]:
    """The keywords of each material."""
    found: list[dict[str, str]] = []
    for line in text.splitlines():
        keyword, _, rest = line.strip().partition(" ")
        if keyword.lower() == "newmtl":
            found.append({"name": rest.strip()})
        elif found:
            found[-1][keyword.lower()] = rest.strip()
    return found


def _material(words: dict[str, str], library: Library, folder: Folder) -> Material:
    picture = library.image(_file_name(words["map_kd"]), folder) if words.get("map_kd") else None
    alpha = _number(words.get("d"), 1.0 - _number(words.get("tr"), 0.0))
    # A perfectly smooth highlight has the exponent infinity (Ns to roughness: B. Walter et al., EGSR 2007).
    shininess = max(_number(words.get("ns"), 10.0), 0.0)
    color = _color(words.get("kd"), (0.6, 0.6, 0.6) if picture is None else (1.0, 1.0, 1.0))
    described = Material(
        name=words["name"],
        base_color=(1.0, 1.0, 1.0) if picture is not None and max(color) < BLACK else color,
        base_color_image=picture,
        metallic=min(max(_number(words.get("pm"), 0.0), 0.0), 1.0),
        roughness=min(max(_number(words.get("pr"), math.sqrt(2.0 / (shininess + 2.0))), 0.0), 1.0),
        emission=_color(words.get("ke"), (0.0, 0.0, 0.0)),
        double_sided=True,
    )
    if words.get("norm"):
        described = replace(described, normal_image=library.image(_file_name(words["norm"]), folder))
    if words.get("map_d") and picture is not None:
        return replace(described, alpha_cutoff=0.5)
    return replace(described, transmission=1.0) if alpha < CLEAR_BELOW else described


def _file_name(words: str) -> str:
    """A map's file, which may have spaces in its name, without the options before it."""
    left = words.split()
    while left and left[0] in _OPTIONS:
        # Fewer numbers than the option may have are allowed.
        count = 1 + next((i for i, word in enumerate(left[1 : 1 + _OPTIONS[left[0]]]) if not _is_value(word)), 3)
        left = left[min(count, 1 + _OPTIONS[left[0]]) :]
    return words[words.index(left[0]) :] if left else words


def _is_value(word: str) -> bool:
    return word in ("on", "off", "r", "g", "b", "m", "l", "z") or word.replace(".", "", 1).lstrip("-").isdigit()


def _number(text: str | None, otherwise: float) -> float:
    try:
        value = float((text or "").split()[-1])
    except (ValueError, IndexError):
        return otherwise
    return value if math.isfinite(value) else otherwise


def _color(text: str | None, otherwise: tuple[float, float, float]) -> tuple[float, float, float]:
    try:
        red, green, blue = (max(float(word), 0.0) for word in (text or "").split()[:3])
    except ValueError:
        return otherwise
    return (red, green, blue)
