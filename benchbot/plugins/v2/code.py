"""Python code of v2's add-ons: read once, and imported from exactly the bytes that were read.

v2 put the folder of a declaration on `sys.path` and left its modules in `sys.modules`, where those of two add-ons could
clash. Here a folder's modules see each other only while code of that folder runs, and nothing stays behind.
"""

import importlib
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from hashlib import sha256
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from benchbot.core.errors import BenchbotError, ExitCode, did_you_mean

REQUIREMENTS = ".dependencies-python"
_RUNNING = threading.RLock()

Function = Callable[..., Any]


@dataclass(frozen=True)
class Code:
    """The files of an add-on that decide what it runs: Python, and the declarations that name functions in it."""

    root: Path
    files: dict[Path, bytes] = field(repr=False)
    _modules: dict[Path, dict[str, ModuleType]] = field(default_factory=dict, repr=False)

    @classmethod
    def read(cls, root: Path, paths: Iterable[Path]) -> "Code":
        """Read the files; raises BenchbotError for one that cannot be read."""
        files = {}
        for path in sorted(set(paths)):
            try:
                files[path] = path.read_bytes()
            except OSError as error:
                raise BenchbotError(
                    f"Cannot read {path}.", error.strerror or str(error), "Make it readable for you, or remove it."
                ) from error
        return cls(root, files)

    @property
    def digest(self) -> str:
        """The SHA-256 over names and bytes: another one means other code."""
        digest = sha256()
        for path, content in self.files.items():
            digest.update(f"{path.relative_to(self.root).as_posix()}\0{len(content)}\0".encode())
            digest.update(content)
        return digest.hexdigest()

    def functions(self, declaration: Path, targets: dict[str, str]) -> dict[str, Function]:
        """Return the functions that a declaration names as `module.attribute`, the module being beside it.

        This runs the code of the modules. What the functions raise becomes a BenchbotError with file and line.
        """
        return {name: self._function(declaration, name, target) for name, target in targets.items()}

    def _function(self, declaration: Path, name: str, target: str) -> Function:
        where = f"{declaration}: functions/{name} is '{target}'"
        module_name, _, attribute = target.replace(":", ".").rpartition(".")
        folder = declaration.parent
        file = _module_file(folder, module_name, self.files)
        if file is None:
            known = [path.stem for path in self.files if path.parent == folder and path.suffix == ".py"]
            raise _broken(
                f"There is no function '{target}'.",
                f"{where}, and {folder} holds no {module_name}.py.{did_you_mean(module_name, known)}",
            )
        with self._siblings(folder):
            try:
                module = importlib.import_module(module_name)
            # Importing is running: it may fail in any way at all.
            except (Exception, SystemExit) as error:
                raise self._not_importable(error, file) from error
        found = getattr(module, attribute, None)
        if not callable(found):
            known = [key for key, value in vars(module).items() if callable(value)]
            raise _broken(
                f"There is no function '{target}'.",
                f"{where}, but {file} has no function '{attribute}'.{did_you_mean(attribute, known)}",
            )
        return self._guarded(found, name, folder)

    def _guarded(self, function: Function, name: str, folder: Path) -> Function:
        @wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            with self._siblings(folder):
                try:
                    return function(*args, **kwargs)
                # An add-on may fail in any way at all; v2's validate with `assert`.
                except (Exception, SystemExit) as error:
                    trace = error.__traceback__
                    if isinstance(error, TypeError) and trace is not None and trace.tb_next is None:
                        raise  # the arguments do not fit: the function was not entered
                    raise self._failed(error, name) from error

        return call

    @contextmanager
    def _siblings(self, folder: Path) -> Iterator[None]:
        """Resolve `import x` to the file x.py of a folder of the add-on while its code runs."""
        beside = {path.stem for path in self.files if path.parent == folder}
        beside |= {path.parent.name for path in self.files if path.name == "__init__.py"}
        finder = _Finder(folder, self.files)
        with _RUNNING:
            ours = self._modules.setdefault(folder, {})
            others = {name: sys.modules.pop(name) for name in [*sys.modules] if name.partition(".")[0] in beside}
            sys.modules.update(ours)
            sys.meta_path.insert(0, finder)
            try:
                yield
            finally:
                sys.meta_path.remove(finder)
                for name, module in [*sys.modules.items()]:
                    if isinstance(getattr(module, "__loader__", None), _Loader):
                        ours[name] = sys.modules.pop(name)
                sys.modules.update(others)

    def _place(self, error: BaseException) -> str:
        """Return ` (file:line)` of the last line of the add-on's own code that ran, or an empty string."""
        own = [frame for frame in traceback.extract_tb(error.__traceback__) if Path(frame.filename) in self.files]
        path, line = (own[-1].filename, own[-1].lineno) if own else ("", None)
        if isinstance(error, SyntaxError) and error.filename:
            path, line = error.filename, error.lineno
        # Solutions are shown this: where the add-ons are, with their ground truths, is not for them to know.
        return f" ({Path(path).relative_to(self.root)}:{line})" if Path(path) in self.files else ""

    def _not_importable(self, error: BaseException, file: Path) -> BenchbotError:
        fix = "Mend the file, or report it to the add-on's author."
        requirements = self.root / REQUIREMENTS
        if isinstance(error, ModuleNotFoundError):
            wanted = f"-r {requirements}" if requirements.is_file() else error.name
            fix = f"Install what it needs, if you trust it: pip install {wanted}"
        return BenchbotError(
            f"{file} cannot be imported.",
            f"{type(error).__name__}: {error.msg if isinstance(error, SyntaxError) else error}{self._place(error)}",
            fix,
        )

    def _failed(self, error: BaseException, name: str) -> BenchbotError:
        place = self._place(error)
        if isinstance(error, BenchbotError):
            return error
        if isinstance(error, AssertionError):
            line = traceback.extract_tb(error.__traceback__)[-1].line
            return BenchbotError(
                f"{name}() refuses what it was given.",
                f"{str(error) or f'This does not hold: {line}'}{place}",
                "Give it what the add-on's format asks for; the line above says what it checks.",
                exit_code=ExitCode.SUBMISSION_FAILED,
            )
        return BenchbotError(
            f"{name}() failed.",
            f"{type(error).__name__}: {error}{place}",
            "Check what it was given; if that is right, report this to the add-on's author.",
            exit_code=ExitCode.SUBMISSION_FAILED,
        )


class _Loader(SourceFileLoader):
    """Loads a module from the bytes that were read. Files of bytecode are neither read nor written."""

    def __init__(self, name: str, path: str, source: bytes) -> None:
        super().__init__(name, path)
        self._source = source

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self._source, self.path)


class _Finder(MetaPathFinder):
    """Finds modules among the files of an add-on: those of one folder, and those of packages in it."""

    def __init__(self, folder: Path, files: dict[Path, bytes]) -> None:
        self._folder = folder
        self._files = files

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        name = fullname.rpartition(".")[2]
        for folder in [self._folder] if path is None else map(Path, path):
            file = _module_file(folder, name, self._files)
            if file is not None:
                return spec_from_file_location(
                    fullname,
                    file,
                    loader=_Loader(fullname, str(file), self._files[file]),
                    submodule_search_locations=[str(file.parent)] if file.name == "__init__.py" else None,
                )
        return None


def _module_file(folder: Path, module: str, files: dict[Path, bytes]) -> Path | None:
    path = folder.joinpath(*module.split("."))
    found = [file for file in (path / "__init__.py", path.with_name(f"{path.name}.py")) if file in files]
    return found[0] if found and module else None


def _broken(title: str, why: str) -> BenchbotError:
    return BenchbotError(title, why, "Correct the name, or report it to the add-on's author.")
