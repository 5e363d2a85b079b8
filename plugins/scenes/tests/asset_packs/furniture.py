"""Small libraries of furniture and Debian packages, made as the real ones are."""

import bz2
import gzip
import io
import lzma
import tarfile
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from PIL import Image

BOX = """\
mtllib {name}.mtl
o {name}
v -1 0 -2
v 1 0 -2
v 1 0 2
v -1 0 2
v -1 3 -2
v 1 3 -2
v 1 3 2
v -1 3 2
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl sides
f 4/1 3/2 7/3 8/4
f 3/1 2/2 6/3 7/4
f 2/1 1/2 5/3 6/4
f 1/1 4/2 8/3 5/4
o lid
usemtl top
f 8 7 6 5
f 1 2 3 4
"""
"""2 x 3 x 4 units (width, height, depth), on the ground."""

MTL = "newmtl sides\nKd 0.5 0.5 0.5\nmap_Kd {texture}\nnewmtl top\nKd 0 0 0\nd 0.3\n"

COMPRESS: Mapping[str, Callable[[bytes], bytes]] = {"xz": lzma.compress, "gz": gzip.compress, "bz2": bz2.compress}

HEAD = "id=Test#Models\nname=Test furniture\nlicense=Creative Commons Attribution 3.0 Unported license \xa9 Us\n\n"


def entry(number: int, furniture: str, **changes: str) -> str:
    """An entry of a catalogue: a box of 50 x 60 x 70 cm (width, depth, height)."""
    name = furniture.partition("#")[2]
    values = {
        "id": furniture,
        "name": name.title(),
        "model": f"/models/{name}/{name}.obj",
        "width": "50",
        "depth": "60",
        "height": "70",
        "creator": "Ren\xe9",
    }
    return "".join(f"{key}#{number}={value}\r\n" for key, value in {**values, **changes}.items()) + "\r\n"


def box(name: str, texture: str = "wood.png") -> dict[str, bytes]:
    """The files of a model."""
    picture = io.BytesIO()
    Image.fromarray(np.full((1024, 8, 3), (200, 40, 40), np.uint8)).save(picture, "PNG")
    return {
        f"models/{name}/{name}.obj": BOX.format(name=name).encode(),
        f"models/{name}/{name}.mtl": MTL.format(texture=texture).encode(),
        f"models/{name}/wood.png": picture.getvalue(),
    }


def sh3f(path: Path, catalogue: str, files: Mapping[str, bytes]) -> Path:
    """Write a library."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("PluginFurnitureCatalog.properties", (HEAD + catalogue).encode("latin-1"))
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def deb(path: Path, files: Mapping[str, bytes], compression: str = "xz") -> Path:
    """Write a Debian package that installs these files."""
    data = io.BytesIO()
    with tarfile.open(fileobj=data, mode="w") as archive:
        for name, content in files.items():
            member = tarfile.TarInfo(f"./{name}")
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    path.write_bytes(ar({"debian-binary": b"2.0\n", f"data.tar.{compression}": COMPRESS[compression](data.getvalue())}))
    return path


def ar(members: Mapping[str, bytes]) -> bytes:
    """An archive in the format of ar."""
    out = b"!<arch>\n"
    for name, content in members.items():
        out += f"{name:<16}{0:<12}{0:<6}{0:<6}{100644:<8}{len(content):<10}`\n".encode()
        out += content + b"\n" * (len(content) % 2)
    return out
