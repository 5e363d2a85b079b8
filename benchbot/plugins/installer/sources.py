"""Sources of plug-ins, told apart: names, wheels, projects, git repositories, and folders of BenchBot v2's add-ons."""

import os
import re
import shutil
import tempfile
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import file_digest
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import InvalidWheelFilename, canonicalize_name, parse_wheel_filename

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.indexes import Indexes, fetch, without_credentials
from benchbot.plugins.installer.installers import Installer

_GIT = re.compile(r"git\+\S+|git@\S+|ssh://\S+|\S+\.git(@[\w./-]+)?")
_SAFE_BACKENDS = {"hatchling.build": "hatchling", "flit_core.buildapi": "flit_core"}


@dataclass(frozen=True)
class RequirementLine:
    """A line of a requirements file; a wheel has an `origin` (PEP 610), a distribution from an index has none."""

    text: str
    origin: dict[str, Any] | None = None

    @property
    def requirement(self) -> Requirement:
        """The line without its hashes."""
        return Requirement(re.split(r"\s--hash=", self.text, maxsplit=1)[0])

    @property
    def name(self) -> str:
        """The normalized name of the distribution."""
        return canonicalize_name(self.requirement.name)

    @property
    def is_hash_of_version(self) -> bool:
        """Whether it asks for one version, with hashes."""
        return "--hash=" in self.text and any(one.operator == "==" for one in self.requirement.specifier)


@dataclass(frozen=True)
class AddonFolder:
    """A folder of v2's add-ons, and its origin."""

    path: Path
    origin: str
    revision: str | None = None


@dataclass(frozen=True)
class SourcePreparer:
    """Downloads, clones and builds sources below `folder`; `may_build` is asked before a source's own code runs."""

    folder: Path
    installer: Installer
    indexes: Indexes
    may_build: Callable[[str], bool]

    def prepare(self, text: str) -> RequirementLine | AddonFolder:
        """Return the requirement that a word of the command line asks for; raises BenchbotError if it asks for none."""
        address, _, fragment = text.partition("#")
        is_url, is_wheel = address.startswith(("http://", "https://")), address.endswith(".whl")
        if _GIT.fullmatch(text) or (is_url and not is_wheel):
            return self._repository(text)
        path = Path(address).expanduser().absolute()
        if is_wheel:
            line = self._download(address) if is_url else _wheel(path, {"url": path.as_uri()})
            wanted = fragment.partition("sha256=")[2]
            if wanted and not line.text.endswith(f":{wanted}"):
                raise BenchbotError(
                    f"{without_credentials(address)} is not what was asked for: its hash is wrong.",
                    f"Its SHA-256 is {line.text.rpartition(':')[2]}.",
                    "Do not install it: somebody may have replaced the file.",
                )
            return line
        if path.is_dir() and ("/" in text or text in (".", "..")):
            folder = Path(os.path.normpath(path))
            return self._folder(folder, {"url": folder.as_uri(), "dir_info": {}}, str(folder))
        line = RequirementLine(text)
        try:
            if line.requirement.url is None:
                return line
        except InvalidRequirement:
            pass
        raise BenchbotError(
            f"'{without_credentials(text)}' is nothing that can be installed.",
            "It is no name of a distribution, no wheel, no folder, no git repository."
            f"{f' The folder is written ./{text}.' if path.is_dir() else ''}",
            "Write NAME, NAME==VERSION, ./FOLDER, ./FILE.whl or git+https://…",
        )

    def _folder(
        self, path: Path, origin: dict[str, Any], name: str, revision: str | None = None
    ) -> RequirementLine | AddonFolder:
        if not (path / "pyproject.toml").is_file() and not (path / "setup.py").is_file():
            from benchbot.plugins.v2 import addons

            addons.find(path)
            return AddonFolder(path, name, revision)
        if not builds_without_own_code(path) and not self.may_build(name):
            raise BenchbotError(
                f"{name} was not built.",
                "Building it runs its code with all your rights, and you have not allowed it.",
                "Look at it; if you trust it, give --trust.",
            )
        wheels = self._new_folder()
        self.installer.build(path, wheels, self.indexes)
        built = list(wheels.glob("*.whl"))
        if len(built) != 1:
            raise BenchbotError(
                f"{name} could not be built.", f"There were {len(built)} wheels.", "See: pip wheel --no-deps FOLDER"
            )
        return _wheel(built[0], origin)

    def _repository(self, text: str) -> RequirementLine | AddonFolder:
        git = shutil.which("git")
        if git is None:
            raise BenchbotError(
                "git is not installed.",
                "It is needed to fetch a repository.",
                "Install it: apt install git, or brew install git",
            )
        url, reference = split_reference(text.removeprefix("git+"))
        folder = self._new_folder() / addon_name(url)
        run, quiet = self.installer.runner.run, {"GIT_TERMINAL_PROMPT": "0"}
        done = run([git, "clone", "--quiet", "--", url, str(folder)], quiet)
        if done.code == 0 and reference:
            done = run([git, "-C", str(folder), "checkout", "--quiet", reference, "--"], quiet)
        if done.code != 0:
            raise BenchbotError(
                f"{without_credentials(text)} cannot be fetched.",
                f"git says: {done.err.strip()[-500:]}",
                "Check the address, the network and your access: git clone ADDRESS",
            )
        commit = run([git, "-C", str(folder), "rev-parse", "HEAD"]).out.strip()
        shutil.rmtree(folder / ".git")
        public = without_credentials(url)
        vcs = {"vcs": "git", "commit_id": commit, **({"requested_revision": reference} if reference else {})}
        name = f"git+{public}{f'@{reference}' if reference else ''}"
        return self._folder(folder, {"url": public, "vcs_info": vcs}, name, commit)

    def _download(self, url: str) -> RequirementLine:
        path = self._new_folder() / Path(unquote(url)).name
        path.write_bytes(fetch(url, "application/octet-stream"))
        return _wheel(path, {"url": without_credentials(url)})

    def _new_folder(self) -> Path:
        return Path(tempfile.mkdtemp(dir=self.folder))


def _wheel(path: Path, origin: dict[str, Any]) -> RequirementLine:
    try:
        why = None if path.is_file() else "There is no such file."
        name = parse_wheel_filename(path.name)[0]
    except InvalidWheelFilename:
        why = why or "A wheel's file is called NAME-VERSION-PYTHON-ABI-PLATFORM.whl."
    if why is not None:
        raise BenchbotError(f"There is no wheel {path}.", why, "Check the path.")
    with path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()
    if "dir_info" not in origin and "vcs_info" not in origin:
        origin = {**origin, "archive_info": {"hashes": {"sha256": digest}}}
    return RequirementLine(f"{name} @ {path.as_uri()} --hash=sha256:{digest}", origin)


def read_requirements(path: Path) -> list[str]:
    """Return the lines of a requirements file, without comments, and with lines joined that end in a backslash.

    Raises BenchbotError for a file that cannot be read, and for lines with options of pip.
    """
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise BenchbotError(f"{path} cannot be read.", f"{reason}.", "Name a file of requirements.") from error
    lines = [re.sub(r"(^|\s)#.*", "", line).strip() for line in re.sub(r"\\\r?\n", " ", text).splitlines()]
    for line in lines:
        if line.startswith("-"):
            raise BenchbotError(
                f"{path} holds an option, '{line}'.",
                "A line names a distribution, a folder, a repository or a wheel.",
                "Give options on the command line: benchbot install -r FILE --index-url …",
            )
    return [" ".join(line.split()) for line in lines if line]


def builds_without_own_code(project: Path) -> bool:
    """Say whether building a project runs no code of its own: a known backend, without hooks."""
    try:
        settings = tomllib.loads((project / "pyproject.toml").read_text("utf-8"))
        system = settings.get("build-system", {})
        required = [Requirement(str(text)) for text in system.get("requires", ())]
    except (OSError, ValueError):  # InvalidRequirement is a ValueError
        return False
    hatch = settings.get("tool", {}).get("hatch", {})
    return (
        system.get("build-backend") in _SAFE_BACKENDS
        and "backend-path" not in system
        and all(one.name in _SAFE_BACKENDS.values() and not one.url and not one.extras for one in required)
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


def split_reference(url: str) -> tuple[str, str]:
    """Return the address of a repository and the branch, tag or commit after it, or "": `…/name.git@v1.0`."""
    start = url.find("/", url.find("://") + 3) if "://" in url else url.find(":")
    path, at, reference = url[max(start, 0) :].partition("@")
    return (url[: max(start, 0)] + path, reference) if at and re.fullmatch(r"\w[\w./-]*", reference) else (url, "")


def addon_name(url: str) -> str:
    """Return `user/repository` of an address, v2's name of its add-ons; as a path it stays below its folder."""
    parts = [re.sub(r"[^\w.-]", "_", part) for part in re.split(r"[/:]", url.removesuffix("/").removesuffix(".git"))]
    return "/".join([part for part in parts if part.strip(".")][-2:])
