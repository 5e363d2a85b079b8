"""What was asked for, told apart: a name, a wheel, a project, a git repository, or add-ons of BenchBot v2."""

import os
import re
import shutil
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import file_digest
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.distributions import normal
from benchbot.plugins.installer.indexes import Indexes, public
from benchbot.plugins.installer.installers import Installer
from benchbot.plugins.installer.running import Runner, program

_NAME = re.compile(
    r"[A-Za-z0-9]([\w.-]*[A-Za-z0-9])?(\[[\w\s.,-]*\])?\s*((==|>=|<=|~=|!=|>|<).*)?(\s--hash=.*)?", re.DOTALL
)
_GIT = re.compile(r"git\+\S+|git@\S+|ssh://\S+|\S+\.git(@[\w./-]+)?")
_INERT_BACKENDS = {"hatchling.build", "flit_core.buildapi"}


@dataclass(frozen=True)
class Line:
    """A line of requirements for the installer; `wheel` and `origin` (PEP 610) where it does not come from an index."""

    text: str
    wheel: Path | None = None
    origin: dict[str, Any] | None = None

    @property
    def name(self) -> str:
        """The normal name of the distribution."""
        return normal(re.split(r"[\[\s=<>~!;@]", self.text, maxsplit=1)[0])


@dataclass(frozen=True)
class Folder:
    """A folder of v2's add-ons, and where it came from."""

    path: Path
    origin: str
    revision: str | None = None


@dataclass(frozen=True)
class Workshop:
    """Where sources are made ready: a folder to work in, and who may say that code of theirs may run."""

    folder: Path
    installer: Installer
    indexes: Indexes
    runner: Runner
    may_build: Callable[[str], bool]

    def take(self, text: str) -> Line | Folder:
        """Return what a word of the command line asks for, wheels built; raises BenchbotError for what is nothing."""
        address, _, fragment = text.partition("#")
        is_url, is_wheel = address.startswith(("http://", "https://")), address.endswith(".whl")
        if _GIT.fullmatch(text) or (is_url and not is_wheel):
            return self._repository(text)
        path = Path(address).expanduser()
        if is_wheel:
            line = self._download(address) if is_url else self._wheel(path.absolute(), _origin(path))
            return _is_what_was_asked_for(line, address, fragment)
        if path.is_dir() and ("/" in text or text in (".", "..")):
            folder = Path(os.path.normpath(path.absolute()))
            return self._folder(folder, {"url": folder.as_uri(), "dir_info": {}}, str(folder))
        if _NAME.fullmatch(text):
            return Line(text)
        raise BenchbotError(
            f"'{public(text)}' is nothing that can be installed.",
            "It is no name of a distribution, no wheel, no folder, no git repository."
            f"{f' The folder is written ./{text}.' if path.is_dir() else ''}",
            "Write NAME, NAME==VERSION, ./FOLDER, ./FILE.whl or git+https://…",
        )

    def _wheel(self, path: Path, origin: dict[str, Any]) -> Line:
        parts = path.name.removesuffix(".whl").split("-")
        if not path.is_file() or len(parts) not in (5, 6):
            raise BenchbotError(
                f"There is no wheel {path}.",
                "A wheel's file is called NAME-VERSION-PYTHON-ABI-PLATFORM.whl."
                if path.is_file()
                else "There is no such file.",
                "Check the path.",
            )
        with path.open("rb") as file:
            digest = file_digest(file, "sha256").hexdigest()
        if "dir_info" not in origin and "vcs_info" not in origin:
            origin = {**origin, "archive_info": {"hashes": {"sha256": digest}}}
        return Line(f"{normal(parts[0])} @ {path.as_uri()} --hash=sha256:{digest}", path, origin)

    def _folder(self, path: Path, origin: dict[str, Any], name: str, revision: str | None = None) -> Line | Folder:
        if not (path / "pyproject.toml").is_file() and not (path / "setup.py").is_file():
            from benchbot.plugins.v2 import addons

            addons.find(path)
            return Folder(path, name, revision)
        if not builds_inertly(path) and not self.may_build(name):
            raise BenchbotError(
                f"{name} was not built.",
                "Building it runs its code with all your rights, and you have not allowed it.",
                "Look at it; if you trust it, give --trust.",
            )
        wheels = self.folder / f"wheels_{len(list(self.folder.iterdir()))}"
        wheels.mkdir()
        self.installer.build(path, wheels, self.indexes)
        built = list(wheels.glob("*.whl"))
        if len(built) != 1:
            raise BenchbotError(
                f"{name} could not be built.", f"There were {len(built)} wheels.", "See: pip wheel --no-deps FOLDER"
            )
        return self._wheel(built[0], origin)

    def _repository(self, text: str) -> Line | Folder:
        git = program("git", "fetch a repository", "Install it: apt install git, or brew install git")
        url, reference = _split(text.removeprefix("git+"))
        folder = self.folder / f"repository_{len(list(self.folder.iterdir()))}" / "/".join(_last_two(url))
        folder.parent.mkdir(parents=True)
        quiet = {"GIT_TERMINAL_PROMPT": "0"}
        done = self.runner.run([git, "clone", "--quiet", "--", url, str(folder)], quiet)
        if done.code == 0 and reference:
            done = self.runner.run([git, "-C", str(folder), "checkout", "--quiet", reference, "--"], quiet)
        if done.code != 0:
            raise BenchbotError(
                f"{public(text)} cannot be fetched.",
                f"git says: {done.err.strip()[-500:]}",
                "Check the address, the network and your access: git clone ADDRESS",
            )
        commit = self.runner.run([git, "-C", str(folder), "rev-parse", "HEAD"]).out.strip()
        shutil.rmtree(folder / ".git")
        vcs = {"vcs": "git", "commit_id": commit, **({"requested_revision": reference} if reference else {})}
        name = f"git+{public(url)}{f'@{reference}' if reference else ''}"
        return self._folder(folder, {"url": public(url), "vcs_info": vcs}, name, commit)

    def _download(self, url: str) -> Line:
        from benchbot.plugins.installer.fetching import fetch

        path = self.folder / f"downloads_{len(list(self.folder.iterdir()))}" / url.rpartition("/")[2]
        path.parent.mkdir()
        path.write_bytes(fetch(url, "application/octet-stream"))
        return self._wheel(path, {"url": public(url)})


def _origin(path: Path) -> dict[str, Any]:
    return {"url": path.absolute().as_uri()}


def _is_what_was_asked_for(line: Line, address: str, fragment: str) -> Line:
    wanted = fragment.partition("sha256=")[2]
    if wanted and not line.text.endswith(f":{wanted}"):
        raise BenchbotError(
            f"{public(address)} is not what was asked for: its hash is wrong.",
            f"Its SHA-256 is {line.text.rpartition(':')[2]}.",
            "Do not install it: somebody may have replaced the file.",
        )
    return line


def builds_inertly(project: Path) -> bool:
    """Say whether building a project runs no code of its own: a known backend, without hooks."""
    try:
        settings = tomllib.loads((project / "pyproject.toml").read_text("utf-8"))
    except (OSError, ValueError):
        return False
    system = settings.get("build-system", {})
    hatch = settings.get("tool", {}).get("hatch", {})
    return (
        system.get("build-backend") in _INERT_BACKENDS
        and "backend-path" not in system
        and all(re.fullmatch(r"(hatchling|flit_core)\s*([<>=~!].*)?", str(text)) for text in system.get("requires", ()))
        and not (project / "hatch.toml").exists()
        and "hooks" not in _keys(hatch)
        and set(hatch.get("version", {})) <= {"path", "pattern"}
        # flit finds version and summary by reading; where it cannot, it imports.
        and (system.get("build-backend") == "hatchling.build" or not settings.get("project", {}).get("dynamic"))
    )


def _keys(tree: Any) -> set[str]:
    if isinstance(tree, dict):
        return set(tree) | {key for value in tree.values() for key in _keys(value)}
    return {key for item in tree for key in _keys(item)} if isinstance(tree, list) else set()


def _split(url: str) -> tuple[str, str]:
    """Return the address of a repository and what is wanted of it: `…/name.git@v1.0`."""
    start = url.find("/", url.find("://") + 3) if "://" in url else url.find(":")
    path, at, reference = url[max(start, 0) :].partition("@")
    return (url[: max(start, 0)] + path, reference) if at and re.fullmatch(r"\w[\w./-]*", reference) else (url, "")


def _last_two(url: str) -> list[str]:
    """Return `user` and `repository` of an address, as v2 calls add-ons; nothing in them leads elsewhere."""
    parts = [re.sub(r"[^\w.-]", "_", part) for part in re.split(r"[/:]", url.removesuffix("/").removesuffix(".git"))]
    return [part for part in parts if part.strip(".")][-2:]
