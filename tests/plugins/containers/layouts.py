"""Image layouts made by hand, sound ones and others: their files by path."""

import gzip
import hashlib
import io
import json
import platform
import tarfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from benchbot.plugins.containers.layout import ARCHITECTURES, INDEX, MANIFESTS, MARKER, blob_of

CONFIG = "application/vnd.oci.image.config.v1+json"
COMPRESSED = "application/vnd.oci.image.layer.v1.tar+gzip"
PLAIN = "application/vnd.oci.image.layer.v1.tar"


def digest(content: bytes) -> str:
    return f"sha256:{hashlib.sha256(content).hexdigest()}"


def layer(*members: tuple[str, bytes] | tarfile.TarInfo) -> bytes:
    """Return an archive of files, or of anything else that a header can say."""
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w") as archive:
        for member in members:
            if isinstance(member, tarfile.TarInfo):
                archive.addfile(member)
            else:
                about = tarfile.TarInfo(member[0])
                about.size = len(member[1])
                archive.addfile(about, io.BytesIO(member[1]))
    return file.getvalue()


def special(name: str, kind: bytes, target: str = "") -> tarfile.TarInfo:
    about = tarfile.TarInfo(name)
    about.type, about.linkname = kind, target
    return about


def described(kind: str, content: bytes) -> dict[str, Any]:
    return {"mediaType": kind, "digest": digest(content), "size": len(content)}


def make(layers: Sequence[bytes], *, packed: bool = True, config: Mapping[str, Any] = {}) -> dict[str, bytes]:
    """Return the files of a sound layout with these layers."""
    packs: Callable[[bytes], bytes] = (lambda content: gzip.compress(content, mtime=0)) if packed else bytes
    about = {
        "os": "linux",
        "architecture": ARCHITECTURES[platform.machine()],
        "rootfs": {"type": "layers", "diff_ids": [digest(content) for content in layers]},
        **config,
    }
    blobs = [json.dumps(about).encode(), *map(packs, layers)]
    manifest = {
        "schemaVersion": 2,
        "mediaType": MANIFESTS[0],
        "config": described(CONFIG, blobs[0]),
        "layers": [described(COMPRESSED if packed else PLAIN, blob) for blob in blobs[1:]],
    }
    return {
        MARKER: b'{"imageLayoutVersion": "1.0.0"}',
        **{blob_of(digest(blob)): blob for blob in blobs},
    } | with_manifest(manifest)


def with_manifest(*manifests: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the files of manifests, and the index that names them."""
    contents = [json.dumps(manifest).encode() for manifest in manifests]
    index = {"schemaVersion": 2, "manifests": [described(MANIFESTS[0], content) for content in contents]}
    return {**{blob_of(digest(content)): content for content in contents}, INDEX: json.dumps(index).encode()}


def manifest_of(files: Mapping[str, bytes]) -> dict[str, Any]:
    """Return the manifest of a sound layout."""
    (named,) = json.loads(files[INDEX])["manifests"]
    found: dict[str, Any] = json.loads(files[blob_of(named["digest"])])
    return found


def opened(files: Mapping[str, bytes]) -> dict[str, Callable[[], IO[bytes]]]:
    """Return files as they are read."""

    def opener(content: bytes) -> Callable[[], IO[bytes]]:
        return lambda: io.BytesIO(content)

    return {name: opener(content) for name, content in files.items()}


def write(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Write files into a new folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder
