"""Reading a file and what it refers to: nothing from outside its folder, nothing from the network, nothing huge."""

import io
import zipfile
from pathlib import Path
from urllib.parse import unquote

import numpy as np
from PIL import Image, UnidentifiedImageError

from benchbot.plugin import BenchbotError
from benchbot_scenes.scene import ImageArray

MAX_FILE_BYTES = 4 * 2**30
MAX_TEXTURE_BYTES = 256 * 2**20


def check(path: Path) -> None:
    """Raise BenchbotError unless `path` is a file with something in it, of a size that can be handled."""
    if not path.exists():
        raise BenchbotError(f"There is no file {path}", "The path names nothing.", "Check how it is written.")
    if not path.is_file():
        raise BenchbotError(f"{path} is not a file", "A scene is one file.", "Name the file, not its folder.")
    try:
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except OSError as error:
        raise BenchbotError(f"{path} cannot be read", str(error), "Make it a readable file.") from error
    if size == 0:
        raise BenchbotError(f"{path} is empty", "The file has no bytes.", "Export or fetch it again.")
    if size > MAX_FILE_BYTES:
        raise BenchbotError(
            f"{path} is too large",
            f"It has {size / 2**30:.1f} GB; up to {MAX_FILE_BYTES / 2**30:.0f} GB are read.",
            "Decimate the mesh, for example with MeshLab's Quadric Edge Collapse.",
        )


class Folder:
    """The files that lie beside a scene's file, by the relative names that it gives them.

    `missing` collects names of textures that are not there.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.missing: list[str] = []

    def find(self, name: str) -> Path | None:
        """The file of that name, None when there is none; raises BenchbotError when it would be elsewhere."""
        written = unquote(name).replace("\\", "/").strip()
        looks_absolute = written.startswith(("/", "~")) or written[1:3] == ":/" or "://" in written
        root = self._path.parent.resolve()
        if looks_absolute or "\0" in written or not (root / written).resolve().is_relative_to(root):
            raise BenchbotError(
                f"{self._path.name} refers to a file outside its folder: {name}",
                "Only files beside it, or in folders below it, are read: somebody else's scene shall not reach yours.",
                "Put the file beside it and refer to it by its bare name, or export as GLB, which holds everything.",
            )
        found = root / written
        return found if found.is_file() else None

    def read(self, name: str) -> bytes:
        """The bytes of a file that the scene needs; raises BenchbotError when it is missing or too large."""
        found = self.find(name)
        if found is None:
            raise BenchbotError(
                f"{self._path.name} refers to a file that is not there: {name}",
                f"It should be in {self._path.parent}.",
                "Copy it there, or export as GLB, which holds everything.",
            )
        if found.stat().st_size > MAX_FILE_BYTES:
            raise BenchbotError(
                f"{found} is too large",
                f"It has {found.stat().st_size / 2**30:.1f} GB.",
                "Export the scene in smaller pieces.",
            )
        return found.read_bytes()

    def read_texture(self, name: str) -> bytes | None:
        """Return the bytes of a texture; None, and an entry in `missing`, if it does not exist or is far too large."""
        found = self.find(name)
        if found is None or found.stat().st_size > MAX_TEXTURE_BYTES:
            self.missing.append(name)
            return None
        return found.read_bytes()


def decode_texture(data: bytes | None, name: str, images: list[ImageArray], notes: list[str]) -> int | None:
    """Append a picture (H, W, 4) to `images` and return its number; None, with a note, for an unusable one."""
    if data is None:
        return None
    try:
        with Image.open(io.BytesIO(data)) as image:
            images.append(np.asarray(image.convert("RGBA")))
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError) as error:
        notes.append(f"The texture {name} is no usable picture ({error}); a plain colour stands for it.")
        return None
    return len(images) - 1


def check_usdz(path: Path) -> None:
    """Raise BenchbotError unless a USDZ package is what its specification asks for: an archive that stores only.

    So it cannot unpack to more than it has: compressed members and members that share bytes are refused.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, OSError, NotImplementedError, ValueError) as error:
        raise BenchbotError(
            f"{path} is not a USDZ package", f"It is no sound ZIP archive: {error}", "Export or fetch it again."
        ) from error
    why = ""
    if any(member.compress_type != zipfile.ZIP_STORED for member in members):
        why = "Its members are compressed; a USDZ package stores them as they are."
    elif sum(member.file_size for member in members) > path.stat().st_size:
        why = "Its members claim more bytes than the archive has."
    elif any(member.filename.startswith("/") or ".." in Path(member.filename).parts for member in members):
        why = "Names in it lead out of the archive."
    if why:
        raise BenchbotError(f"{path} is not a sound USDZ package", why, "Pack it with usdzip, or export it as GLB.")
