"""The image of a solution as files: an OCI image layout of one image, checked.

Nothing of it is run here, or unpacked: an engine does both, once every digest has been found to be right. Source:
https://github.com/opencontainers/image-spec (image-layout.md, manifest.md, config.md, layer.md).
"""

import gzip
import hashlib
import json
import platform
import re
import tarfile
import zlib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import IO, Any, cast

from benchbot.core.errors import BenchbotError

MARKER, INDEX, BLOBS = "oci-layout", "index.json", "blobs/sha256"
LARGEST_UNPACKED_BYTES = 2**34
MOST_DOCUMENT_BYTES = 2**22
MOST_FILES = 500_000
MOST_LAYERS = 500
MOST_HEADER_BYTES = 2**20
"""So long may be what an archive says of one file: names, attributes."""
ARCHITECTURES = {"x86_64": "amd64", "aarch64": "arm64"}
"""This machine's architectures (uname -m), as images name them."""

_DIGEST = re.compile(r"sha256:[0-9a-f]{64}")
MANIFESTS = ("application/vnd.oci.image.manifest.v1+json", "application/vnd.docker.distribution.manifest.v2+json")
LAYER = "application/vnd.oci.image.layer.v1.tar+gzip"
_LAYERS = {
    "application/vnd.oci.image.layer.v1.tar": False,
    "application/vnd.docker.image.rootfs.diff.tar": False,
    LAYER: True,
    "application/vnd.docker.image.rootfs.diff.tar.gzip": True,
}
"""Whether a layer of a kind is compressed; others are refused."""
CHUNK_BYTES = 2**20
Files = Mapping[str, Callable[[], IO[bytes]]]
"""The files of a layout by their paths in it, each a function that opens it."""


@dataclass(frozen=True)
class Layout:
    """The documents of a layout: its image's configuration and layers, as blobs by digest, `sha256:…`."""

    manifest: str
    config: str
    """The digest that engines know an image by."""
    layers: tuple[str, ...]
    compressed: tuple[bool, ...]
    diff_ids: tuple[str, ...]
    """The digests of the layers, unpacked."""


def files_of(folder: Path) -> Files:
    """Return the files of a folder that is a layout."""

    def opener(path: Path) -> Callable[[], IO[bytes]]:
        return lambda: path.open("rb")

    return {path.relative_to(folder).as_posix(): opener(path) for path in folder.rglob("*") if not path.is_dir()}


def read(files: Files) -> Layout:
    """Return what a layout says of its image; raises BenchbotError unless it is of one image for this machine.

    Every document is what its digest says; the layers are not looked at.
    """
    if _document(files, MARKER).get("imageLayoutVersion") != "1.0.0":
        raise _unsound(f"{MARKER} names no version that is known.")
    manifests = _list(_document(files, INDEX), "manifests")
    if len(manifests) != 1:
        raise _unsound(f"It holds {len(manifests)} images; one is handed in.")
    named = _digest(manifests[0], MANIFESTS)
    manifest = _document(files, blob_of(named), named)
    config_digest = _digest(manifest.get("config"))
    config = _document(files, blob_of(config_digest), config_digest)
    described = _list(manifest, "layers")
    layers = tuple(_digest(layer, _LAYERS) for layer in described)
    diff_ids = tuple(_list(config.get("rootfs"), "diff_ids"))
    if len(diff_ids) != len(layers) or len(layers) > MOST_LAYERS:
        raise _unsound(f"Its configuration has {len(diff_ids)} layers, its manifest {len(layers)}.")
    runs_on, here = (config.get("os"), config.get("architecture")), ARCHITECTURES.get(platform.machine())
    if runs_on != ("linux", here):
        raise BenchbotError(
            "The image is for another kind of machine.",
            f"It is for {runs_on[0]!s:.20}, {runs_on[1]!s:.20}; solutions run on linux, {here}.",
            f"Build it anew: podman build --platform linux/{here} -t NAME FOLDER",
        )
    expected = {MARKER, INDEX, *map(blob_of, (named, config_digest, *layers))}
    if set(files) != expected:
        odd = min(set(files) ^ expected)
        raise _unsound(f"{odd!r:.100} is {'not of the image' if odd in files else 'missing'}.")
    return Layout(named, config_digest, layers, tuple(_LAYERS[layer["mediaType"]] for layer in described), diff_ids)


def check(files: Files, most_bytes: int = LARGEST_UNPACKED_BYTES) -> Layout:
    """Return what a layout says of its image, after reading all of it; raises BenchbotError for one that is not sound.

    Each layer is what manifest and configuration say by their digests, an archive of plain paths without devices. All
    of them together are `most_bytes` at most, unpacked; memory stays small whatever is in them.
    """
    found = read(files)
    room = _Room(most_bytes, MOST_FILES)
    for digest, is_compressed, diff_id in zip(found.layers, found.compressed, found.diff_ids, strict=True):
        with files[blob_of(digest)]() as blob:
            if digest_of(blob) != digest:
                raise _unsound(f"Layer {digest} is not what its digest says.")
        with files[blob_of(digest)]() as blob:
            layer = _Layer(cast("IO[bytes]", gzip.GzipFile(fileobj=blob)) if is_compressed else blob, room)
            try:
                _check_archive(layer)
            except (tarfile.TarError, EOFError, zlib.error, gzip.BadGzipFile, ValueError, RecursionError) as error:
                raise _unsound(f"Layer {digest} is no archive: {error!s:.100}.") from error
        if diff_id != f"sha256:{layer.digest.hexdigest()}":
            raise _unsound(f"Layer {digest} is not the one that the configuration names.")
    return found


@dataclass
class _Room:
    """What all layers of an image may still have together."""

    size_bytes: int
    files: int


@dataclass
class _Layer:
    """A layer as it is unpacked, for tarfile to read: counted, hashed, and read no further than `until`."""

    source: IO[bytes]
    room: _Room
    until: int = MOST_HEADER_BYTES + CHUNK_BYTES
    position: int = 0
    digest: Any = field(default_factory=hashlib.sha256)

    def read(self, size: int) -> bytes:
        """Return the next bytes, `size` at most."""
        content = self.source.read(size)
        self.position += len(content)
        self.room.size_bytes -= len(content)
        self.digest.update(content)
        if self.room.size_bytes < 0:
            raise _unsound("Its layers are larger, unpacked, than may be.")
        if self.position > self.until:
            raise _unsound("What it says of one of its files is longer than may be.")
        return content


def _check_archive(layer: _Layer) -> None:
    """Read a layer to its end; raises BenchbotError for a file that no layer should have."""
    with tarfile.open(fileobj=cast("IO[bytes]", layer), mode="r|", bufsize=CHUNK_BYTES) as archive:
        while (member := archive.next()) is not None:
            archive.members.clear()  # type: ignore[attr-defined]  # else they would all be kept
            layer.room.files -= 1
            if layer.room.files < 0:
                raise _unsound(f"It has more than {MOST_FILES} files.")
            if not (member.isreg() or member.isdir() or member.issym() or member.islnk() or member.isfifo()):
                raise _unsound(f"{member.name!r:.100} is a device, or of no known kind.")
            if member.issparse() or member.size < 0:
                raise _unsound(f"{member.name!r:.100} has holes.")
            for path in (member.name, *([member.linkname] if member.islnk() else ())):
                if path.startswith("/") or ".." in PurePosixPath(path).parts:
                    raise _unsound(f"{path!r:.100} leads out of it.")
            layer.until = archive.offset + MOST_HEADER_BYTES + CHUNK_BYTES  # the next begins there
    layer.until = layer.position + layer.room.size_bytes + 1
    while layer.read(CHUNK_BYTES):
        pass


def digest_of(content: IO[bytes]) -> str:
    """Return the digest of all that can be read, `sha256:…`."""
    digest = hashlib.sha256()
    while chunk := content.read(CHUNK_BYTES):
        digest.update(chunk)
    return f"sha256:{digest.hexdigest()}"


def blob_of(digest: str) -> str:
    """Return the path of a blob in a layout by its digest."""
    return f"{BLOBS}/{digest.removeprefix('sha256:')}"


def _document(files: Files, name: str, digest: str | None = None) -> dict[str, Any]:
    """Return a document of a layout: a JSON object that is what its digest says, if it has one."""
    if name not in files:
        raise _unsound(f"It has no {name}.")
    with files[name]() as file:
        content = file.read(MOST_DOCUMENT_BYTES + 1)
    if len(content) > MOST_DOCUMENT_BYTES:
        raise _unsound(f"{name} is larger than may be.")
    if digest is not None and f"sha256:{hashlib.sha256(content).hexdigest()}" != digest:
        raise _unsound(f"{name} is not what its digest says.")
    try:
        document = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise _unsound(f"{name} is no JSON.") from error
    if not isinstance(document, dict):
        raise _unsound(f"{name} is no JSON object.")
    return document


def _list(document: Any, key: str) -> list[Any]:
    found = document.get(key) if isinstance(document, dict) else None
    if not isinstance(found, list):
        raise _unsound(f"It has no list of {key}.")
    return found


def _digest(descriptor: Any, kinds: Collection[str] | None = None) -> str:
    """Return the digest that a descriptor names; raises BenchbotError for content that is not in the layout."""
    known = descriptor if isinstance(descriptor, dict) else {}
    digest, kind = known.get("digest"), known.get("mediaType")
    if not isinstance(digest, str) or not _DIGEST.fullmatch(digest) or "urls" in known:
        raise _unsound(f"{digest!r:.100} is no SHA-256 of something in it.")
    if kinds is not None and (not isinstance(kind, str) or kind not in kinds):
        raise _unsound(f"{kind!r:.100} is no kind of content that is handed in.")
    return digest


def _unsound(why: str) -> BenchbotError:
    return BenchbotError("The image is not sound.", why, "Save it anew: benchbot challenge pack IMAGE ARCHIVE.zip")
