"""Images on their way out of an engine and into one, as layouts; and what was loaded, removed once nobody needs it."""

import fcntl
import gzip
import hashlib
import json
import os
import posixpath
import tarfile
from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from socket import gethostname
from typing import IO, Any, cast

from benchbot.core import resources
from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers.engine import Engine, api_errors, failed, reached
from benchbot.plugins.containers.layout import (
    BLOBS,
    CHUNK_BYTES,
    INDEX,
    LAYER,
    MANIFESTS,
    MARKER,
    MOST_DOCUMENT_BYTES,
    Layout,
    blob_of,
    check,
    digest_of,
    files_of,
    read,
)

REPOSITORY = "localhost/benchbot/image"
_GZIP = b"\x1f\x8b"
_JSON = b'{"', b"[{"


def save(engine: Engine, name: str, folder: Path, most_bytes: int) -> str:
    """Write an image of an engine into a new folder, its layers compressed; return its digest, which is its ID.

    Raises BenchbotError when there is none of that name, when it is larger than `most_bytes`, or cannot be saved.
    """
    from docker.errors import APIError

    (folder / BLOBS).mkdir(parents=True)
    try:
        with closing(engine.connect()) as client:
            try:
                client.inspect_image(name)  # type: ignore[no-untyped-call]
            except APIError as error:
                if error.is_client_error():
                    raise _absent(engine, name) from error
                raise
            return _write(folder, client.get_image(name, chunk_size=CHUNK_BYTES), name, most_bytes)
    except (tarfile.TarError, KeyError, ValueError, TypeError) as error:
        raise failed(f"save {name}: what it sends is no such archive", error) from error
    except api_errors() as error:
        raise failed(f"save {name}", error) from error


def load(engine: Engine, folder: Path) -> str:
    """Load the image of a layout into an engine, unless it is there, and return its name.

    All of it is checked before. Raises BenchbotError for a layout that is not sound, or when the engine fails.
    """
    from docker.errors import ImageNotFound

    name = name_of(read(files_of(folder)).config.removeprefix("sha256:"))
    try:
        with closing(engine.connect()) as client:
            with suppress(ImageNotFound):
                client.inspect_image(name)  # type: ignore[no-untyped-call]
                return name
            content = _docker_archive(folder, check(files_of(folder)), name)
            for event in client.load_image(content) or ():  # type: ignore[no-untyped-call]
                if "error" in event:
                    raise failed("load the image", ValueError(event["error"]))
            return name
    except api_errors() as error:
        raise failed("load the image", error) from error


def name_of(digest: str) -> str:
    """Return the name of a loaded image by the digest of its configuration, in hexadecimal digits."""
    return f"{REPOSITORY}:{digest}"


@contextmanager
def in_use(folder: Path) -> Iterator[int]:
    """Keep the image of a layout, once something has loaded it, from `remove_unused` of any process of this user.

    Yields a file descriptor: a process that inherits it keeps the image as well, for as long as it lives.
    """
    with _held(_locks() / read(files_of(folder)).config.removeprefix("sha256:")) as lock:
        yield lock


def remove_unused() -> None:
    """Remove the images from the engine's store that were in use and are no more, also of processes that were killed.

    Raises BenchbotError when there are some, and no engine.
    """
    for path in sorted(_locks().iterdir()):
        with suppress(BlockingIOError, FileNotFoundError), path.open("r+b") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _remove(name_of(path.name))
            path.unlink()


def _locks() -> Path:
    folder = resources.state_dir() / "images" / gethostname()  # the folder may be shared, the engine's store is not
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return folder


@contextmanager
def _held(path: Path) -> Iterator[int]:
    """Hold a lock beside others; a file that its last holder has just removed is made anew."""
    while True:
        with path.open("a+b") as lock:
            fcntl.flock(lock, fcntl.LOCK_SH)
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(lock.fileno()), path.stat()):
                    yield lock.fileno()
                    return


def _remove(name: str) -> None:
    from docker.errors import NotFound

    try:
        with reached() as engine, closing(engine.connect()) as client, suppress(NotFound):
            client.remove_image(name)
    except api_errors() as error:
        raise failed(f"remove {name}", error) from error


@dataclass
class _Chunks:
    """What an engine sends, for tarfile to read, which takes as much as there is."""

    chunks: Iterator[bytes]

    def read(self, _size: int) -> bytes:
        """Return the next chunk, of any size; nothing at the end."""
        return next(self.chunks, b"")


def _opened(stream: _Chunks) -> tarfile.TarFile:
    return tarfile.open(fileobj=cast("IO[bytes]", stream), mode="r|", bufsize=CHUNK_BYTES)


def _write(folder: Path, chunks: Iterator[bytes], image: str, most_bytes: int) -> str:
    """Write the layout of the one image in an archive as `docker save` makes it; return the image's digest."""
    documents: dict[str, bytes] = {}
    layers: dict[str, tuple[str, int]] = {}
    links: dict[str, str] = {}
    with _opened(_Chunks(chunks)) as archive:
        for member in archive:
            name, content = _normal(member.name), archive.extractfile(member) if member.isreg() else None
            if member.issym() or member.islnk():
                links[name] = _normal(member.linkname, PurePosixPath(name).parent if member.issym() else None)
            elif content is not None:
                start = content.read(CHUNK_BYTES)
                if start.startswith(_JSON):
                    documents[name] = start + content.read(MOST_DOCUMENT_BYTES)
                else:
                    layers[name] = _write_layer(folder, start, content, image, most_bytes)
                    most_bytes -= layers[name][1]
    (saved,) = json.loads(documents["manifest.json"])
    config = documents[links.get(saved["Config"], saved["Config"])]
    digest, kept = _write_blob(folder, config), [layers[links.get(name, name)] for name in saved["Layers"]]
    for name in {name for name, _ in layers.values()} - {name for name, _ in kept}:
        (folder / blob_of(name)).unlink()
    manifest = {
        "schemaVersion": 2,
        "mediaType": MANIFESTS[0],
        "config": _described("application/vnd.oci.image.config.v1+json", digest, len(config)),
        "layers": [_described(LAYER, *layer) for layer in kept],
    }
    content_of_manifest = json.dumps(manifest, sort_keys=True).encode()
    described = _described(MANIFESTS[0], _write_blob(folder, content_of_manifest), len(content_of_manifest))
    (folder / INDEX).write_text(json.dumps({"schemaVersion": 2, "manifests": [described]}), "utf-8")
    (folder / MARKER).write_text(json.dumps({"imageLayoutVersion": "1.0.0"}), "utf-8")
    return digest


def _write_layer(folder: Path, start: bytes, rest: IO[bytes], image: str, most_bytes: int) -> tuple[str, int]:
    """Write a layer, compressed if it is not; return its digest and size."""
    path = folder / BLOBS / "partial"
    with path.open("wb") as file:
        packs = nullcontext(file) if start.startswith(_GZIP) else gzip.GzipFile("", "wb", 6, file, mtime=0)
        with packs as target:
            while start:
                target.write(start)
                if file.tell() > most_bytes:
                    raise BenchbotError(
                        f"The image {image} is too large.",
                        "It is more, compressed, than may be uploaded.",
                        f"Build a smaller one; or hand in a folder with a Dockerfile of the line: FROM {image}",
                    )
                start = rest.read(CHUNK_BYTES)
    with path.open("rb") as file:
        digest = digest_of(file)
    return digest, path.replace(folder / blob_of(digest)).stat().st_size


def _write_blob(folder: Path, content: bytes) -> str:
    digest = f"sha256:{hashlib.sha256(content).hexdigest()}"
    (folder / blob_of(digest)).write_bytes(content)
    return digest


def _docker_archive(folder: Path, found: Layout, name: str) -> Iterator[bytes]:
    """Yield a layout as the archive that every engine loads, old ones of docker too."""
    listed = [
        {"Config": blob_of(found.config), "RepoTags": [name], "Layers": [blob_of(layer) for layer in found.layers]}
    ]
    manifest = json.dumps(listed).encode()
    yield from (_header("manifest.json", len(manifest)), manifest, bytes(-len(manifest) % tarfile.BLOCKSIZE))
    for digest in dict.fromkeys((found.config, *found.layers)):
        path = folder / blob_of(digest)
        size_bytes = path.stat().st_size
        yield _header(blob_of(digest), size_bytes)
        with path.open("rb") as file:
            yield from iter(lambda: file.read(CHUNK_BYTES), b"")
        yield bytes(-size_bytes % tarfile.BLOCKSIZE)
    yield bytes(2 * tarfile.BLOCKSIZE)


def _header(name: str, size_bytes: int) -> bytes:
    member = tarfile.TarInfo(name)
    member.size = size_bytes
    return member.tobuf()


def _described(kind: str, digest: str, size_bytes: int) -> dict[str, Any]:
    return {"mediaType": kind, "digest": digest, "size": size_bytes}


def _normal(path: str, within: PurePosixPath | None = None) -> str:
    return posixpath.normpath((within or PurePosixPath()) / path)


def _absent(engine: Engine, name: str) -> BenchbotError:
    return BenchbotError(
        f"There is no image {name}.",
        f"{engine.name} has none of that name on this machine, and there is no such file or folder.",
        f"Get it: {engine.name} pull {name}",
    )
