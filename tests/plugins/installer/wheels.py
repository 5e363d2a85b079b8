"""Wheels written by hand, sound or damaged, and an index on loopback that offers them."""

import base64
import threading
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

HOOKS = """\
from pathlib import Path
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_tasks():
    yield Path(__file__).parent / "tasks"
"""
TASK = "name: {name}\nactions: [move_next]\nobservations: [poses]\nresults_format: object_map\n"


def make(
    folder: Path,
    name: str,
    version: str = "1.0",
    *,
    code: str = HOOKS,
    files: dict[str, str] | None = None,
    requires: Sequence[str] = (),
    entry: bool = True,
    unlisted: dict[str, str] | None = None,
) -> Path:
    """Write a wheel whose package is named like it, with a task of that name unless other files are given."""
    package = name.replace("-", "_")
    info = f"{package}-{version}.dist-info"
    needs = "".join(f"Requires-Dist: {text}\n" for text in requires)
    task = {f"{package}/tasks/{package}.yaml": TASK.format(name=package)}
    contents = {
        f"{package}/__init__.py": code,
        **(task if files is None else files),
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{needs}",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: hand\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        **({f"{info}/entry_points.txt": f"[benchbot]\n{package} = {package}\n"} if entry else {}),
    }
    rows = [f"{path},sha256={_hash(text)},{len(text.encode())}" for path, text in contents.items()]
    folder.mkdir(parents=True, exist_ok=True)
    wheel = folder / f"{package}-{version}-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for path, text in {**contents, **(unlisted or {})}.items():
            archive.writestr(path, text)
        archive.writestr(f"{info}/RECORD", "\n".join([*rows, f"{info}/RECORD,,"]) + "\n")
    return wheel


def _hash(text: str) -> str:
    return base64.urlsafe_b64encode(sha256(text.encode()).digest()).rstrip(b"=").decode()


@dataclass(frozen=True)
class Index:
    """A static index (PEP 503): the folder of its wheels, and its address."""

    folder: Path
    url: str

    def publish(self, wheel: Path, *, digest: str | None = None, content: bytes | None = None) -> None:
        """Offer a wheel, or something damaged in its place; `digest` is what the index says its hash is."""
        name = wheel.name.split("-")[0].replace("_", "-")
        place = self.folder / name
        place.mkdir(parents=True, exist_ok=True)
        true = wheel.read_bytes()
        (place / wheel.name).write_bytes(true if content is None else content)
        link = f'<a href="{wheel.name}#sha256={digest or sha256(true).hexdigest()}">{wheel.name}</a><br>\n'
        with (place / "index.html").open("a") as page:
            page.write(link)
        names = sorted(entry.name for entry in self.folder.iterdir() if entry.is_dir())
        (self.folder / "index.html").write_text("".join(f'<a href="{name}/">{name}</a><br>\n' for name in names))


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: Any) -> None:
        pass


@contextmanager
def serving(folder: Path) -> Iterator[Index]:
    """Serve an index on any free port of loopback."""
    simple = folder / "simple"
    simple.mkdir(parents=True)

    def handler(*arguments: Any) -> _Quiet:
        return _Quiet(*arguments, directory=str(folder))

    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield Index(simple, f"http://127.0.0.1:{server.server_address[1]}/simple")
        server.shutdown()
        thread.join()
