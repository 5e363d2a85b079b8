"""Image layouts: what is taken for one image, and what is refused without being unpacked anywhere."""

import gzip
import json
import tarfile
import tracemalloc
from collections.abc import Callable
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers import layout
from benchbot.plugins.containers.layout import INDEX, MARKER, blob_of
from tests.plugins.containers import layouts

FILES = [
    layouts.layer(("bin/solution", b"#!/bin/sh\n")),
    layouts.layer(("etc/motd", b"hello"), ("etc/.wh.passwd", b"")),
]


@pytest.mark.parametrize("packed", [True, False])
def test_a_sound_layout_is_known_by_the_digest_of_its_configuration(packed: bool) -> None:
    files = layouts.make(FILES, packed=packed)
    found = layout.check(layouts.opened(files))
    assert found.config == layouts.manifest_of(files)["config"]["digest"]
    assert found.diff_ids == tuple(map(layouts.digest, FILES))
    assert found == layout.read(layouts.opened(files))


def other_configuration() -> dict[str, bytes]:
    """The configuration of another image, by a digest that its bytes do not have."""
    files, other = layouts.make(FILES), layouts.make(FILES, config={"config": {"Entrypoint": ["/bin/other"]}})
    files[blob_of(layouts.manifest_of(files)["config"]["digest"])] = other[
        blob_of(layouts.manifest_of(other)["config"]["digest"])
    ]
    return files


def other_layer() -> dict[str, bytes]:
    """A layer that its manifest names, but not its configuration."""
    files = layouts.make(FILES)
    manifest = layouts.manifest_of(files)
    odd = gzip.compress(layouts.layer(("bin/solution", b"other")), mtime=0)
    manifest["layers"][0] = layouts.described(layouts.COMPRESSED, odd)
    kept = layouts.make(FILES)
    config = manifest["config"]["digest"]
    names = {MARKER, blob_of(config), blob_of(manifest["layers"][1]["digest"])}
    return {
        **{name: kept[name] for name in names},
        blob_of(layouts.digest(odd)): odd,
        **layouts.with_manifest(manifest),
    }


def named(change: Callable[[dict[str, Any]], object]) -> dict[str, bytes]:
    """A layout whose manifest says something else."""
    files = layouts.make(FILES)
    manifest = layouts.manifest_of(files)
    (old,) = json.loads(files[INDEX])["manifests"]
    del files[blob_of(old["digest"])]
    change(manifest)
    return {**files, **layouts.with_manifest(manifest)}


def two_images() -> dict[str, bytes]:
    first, second = layouts.make(FILES), layouts.make(FILES[:1])
    both = layouts.with_manifest(layouts.manifest_of(first), layouts.manifest_of(second))
    return {**first, **second, **both}


def bomb() -> bytes:
    """A layer of 64 MiB that are 64 KiB compressed."""
    return layouts.layer(("zeros", bytes(2**26)))


def endless_header() -> bytes:
    """An archive that says 32 MiB of one file before that comes."""
    about = tarfile.TarInfo("././@LongLink")
    about.type, about.size = tarfile.GNUTYPE_LONGNAME, 2**25
    return about.tobuf() + bytes(2**25) + layouts.layer(("x", b""))


def nested_headers() -> bytes:
    about = tarfile.TarInfo("././@LongLink")
    about.type, about.size = tarfile.GNUTYPE_LONGNAME, 1
    return (about.tobuf() + b"x".ljust(512, b"\0")) * 1000 + layouts.layer(("x", b""))


HOSTILE: dict[str, tuple[Callable[[], dict[str, bytes]], str]] = {
    "the configuration is another image's": (other_configuration, "is not what its digest says"),
    "the layer is another one": (other_layer, "is not the one that the configuration names"),
    "a layer lies outside": (lambda: named(lambda it: it["layers"][0].update(digest="../../etc/passwd")), "no SHA-256"),
    "a layer lies elsewhere": (lambda: named(lambda it: it["layers"][0].update(urls=["http://x/"])), "no SHA-256"),
    "a layer is of no known kind": (
        lambda: named(lambda it: it["layers"][0].update(mediaType=f"{layouts.PLAIN}+zstd")),
        "no kind of content",
    ),
    "a layer's kind is no word": (
        lambda: named(lambda it: it["layers"][0].update(mediaType=[layouts.PLAIN])),
        "no kind of content",
    ),
    "a layer is missing": (lambda: named(lambda it: it["layers"].pop()), "2 layers, its manifest 1"),
    "two images": (two_images, "It holds 2 images"),
    "an index in the index": (
        lambda: {
            **layouts.make(FILES),
            INDEX: b'{"manifests": [{"mediaType": "x", "digest": "sha256:%s"}]}' % (b"0" * 64),
        },
        "no kind of content",
    ),
    "a file too many": (lambda: {**layouts.make(FILES), "Dockerfile": b"FROM scratch"}, "'Dockerfile' is not of"),
    "no layout": (lambda: {"solution.py": b""}, "It has no oci-layout"),
    "documents that are none": (lambda: {**layouts.make(FILES), INDEX: b"[" * 10**5}, "index.json is no JSON"),
    "a path that leads out": (lambda: layouts.make([layouts.layer(("../../etc/cron.d/x", b""))]), "leads out of it"),
    "an absolute path": (
        lambda: layouts.make([layouts.layer(layouts.special("/etc/x", tarfile.REGTYPE))]),
        "leads out",
    ),
    "a hard link that leads out": (
        lambda: layouts.make([layouts.layer(layouts.special("x", tarfile.LNKTYPE, "../../../etc/shadow"))]),
        "'../../../etc/shadow' leads out",
    ),
    "a device": (lambda: layouts.make([layouts.layer(layouts.special("sda", tarfile.BLKTYPE))]), "'sda' is a device"),
    "a bomb": (lambda: layouts.make([bomb()]), "larger, unpacked, than may be"),
    "a bomb in a header": (lambda: layouts.make([endless_header()]), "longer than may be"),
    "headers of headers": (lambda: layouts.make([nested_headers()]), "is no archive"),
    "a layer that ends early": (lambda: layouts.make([layouts.layer(("x", bytes(2000)))[:1500]]), "is no archive"),
    "a layer that is none": (lambda: layouts.make([b"x" * 1024]), "is no archive"),
}


@pytest.mark.parametrize(("made", "why"), HOSTILE.values(), ids=HOSTILE)
def test_what_is_not_one_sound_image_is_refused(made: Callable[[], dict[str, bytes]], why: str) -> None:
    files = made()
    tracemalloc.start()
    with pytest.raises(BenchbotError, match="The image is not sound") as raised:
        layout.check(layouts.opened(files), 2**25)
    most_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert why in raised.value.why
    assert most_bytes < 2**24


def test_memory_does_not_grow_with_the_number_of_files(monkeypatch: pytest.MonkeyPatch) -> None:
    header = layouts.special("x", tarfile.REGTYPE).tobuf()
    files = layouts.make([header * 20_000 + bytes(1024)])
    tracemalloc.start()
    layout.check(layouts.opened(files))
    most_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most_bytes < 2**23
    monkeypatch.setattr(layout, "MOST_FILES", 19_999)
    with pytest.raises(BenchbotError) as raised:
        layout.check(layouts.opened(files))
    assert "more than 19999 files" in raised.value.why


def test_an_image_for_another_kind_of_machine_is_refused_with_how_to_build_it() -> None:
    files = layouts.make(FILES, config={"architecture": "riscv64"})
    with pytest.raises(BenchbotError, match="another kind of machine") as raised:
        layout.read(layouts.opened(files))
    assert "--platform linux/" in raised.value.fix


def test_a_compressed_layer_may_have_several_parts() -> None:
    content = FILES[0]
    files = layouts.make([content])
    manifest = layouts.manifest_of(files)
    parts = gzip.compress(content[:700]) + gzip.compress(content[700:])
    manifest["layers"] = [layouts.described(layouts.COMPRESSED, parts)]
    kept = {name: files[name] for name in (MARKER, blob_of(manifest["config"]["digest"]))}
    layout.check(layouts.opened({**kept, blob_of(layouts.digest(parts)): parts, **layouts.with_manifest(manifest)}))
