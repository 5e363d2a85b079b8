"""Build the interfaces that PyPI lacks (tf2_msgs, nav2_msgs, …) from their files, and install them beside this Python.

    python build.py [options for pip, such as -c constraints.txt]

ROS 2's generators write C and Python sources, which become a wheel that pip installs; it takes some seconds, and
nothing is done when the installed wheel was made of the same sources. Needs a C++ compiler: on Debian, root gets one.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import redirect_stdout
from importlib.metadata import PackageNotFoundError, version
from io import StringIO
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory

SOURCES = Path(__file__).parent
PREFIX = Path(sys.prefix)
DISTRIBUTION = "benchbot-test-interfaces"
DEPENDENCIES = (
    "action_msgs",
    "builtin_interfaces",
    "geometry_msgs",
    "nav_msgs",
    "service_msgs",
    "std_msgs",
    "unique_identifier_msgs",
)
LIBRARIES = (
    *(f"{package}__rosidl_generator_{language}" for package in DEPENDENCIES for language in ("c", "py")),
    *(f"{package}__rosidl_typesupport_{kind}" for package in DEPENDENCIES for kind in ("c", "fastrtps_c")),
    *(f"{package}__rosidl_typesupport_introspection_c" for package in DEPENDENCIES),
    *("rosidl_runtime_c", "rosidl_typesupport_c", "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_fastrtps_cpp"),
    *("rosidl_typesupport_introspection_c", "fastcdr", "rmw", "rcutils"),
)
INDEX = "share/ament_index/resource_index/rosidl_interfaces"
# What rmw_fastrtps asks of a type: how to send it, and what it looks like.
TYPESUPPORTS = ["rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"]


def main(pip_options: list[str]) -> None:
    """Build and install, unless it was done."""
    wanted = f"0+{_fingerprint()}"
    try:
        if version(DISTRIBUTION) == wanted:
            return
    except PackageNotFoundError:
        pass
    _require_compiler()
    # From this release on, setuptools makes wheels by itself; Python 3.12 and later bring none.
    _pip("install", *pip_options, "setuptools>=70.1")
    with TemporaryDirectory(prefix="benchbot-interfaces-") as folder:
        wheel = _wheel(Path(folder), wanted)
        _pip("install", "--no-deps", "--no-index", "--force-reinstall", str(wheel))


def _interfaces() -> Iterator[tuple[str, Path]]:
    """Yield each package's name and interface file, relative to the package's folder."""
    for path in sorted(SOURCES.glob("*/*/*.*")):
        if path.suffix in (".msg", ".action"):
            package, *rest = path.relative_to(SOURCES).parts
            yield package, Path(*rest)


def _fingerprint() -> str:
    """Return what the wheel is made of, as a local version: this script, the interfaces and the libraries."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for package, interface in _interfaces():
        digest.update(f"{package}/{interface}".encode())
        digest.update((SOURCES / package / interface).read_bytes())
    digest.update(version("ros-geometry-msgs").encode())
    return digest.hexdigest()[:16]


def _require_compiler() -> None:
    if shutil.which("c++"):
        return
    if os.geteuid() == 0 and shutil.which("apt-get"):
        subprocess.run(["apt-get", "update", "-qq"], check=True)
        subprocess.run(["apt-get", "install", "-qq", "-y", "--no-install-recommends", "g++"], check=True)
        return
    sys.exit("The ROS 2 interfaces of the tests need a C++ compiler, and there is none. Install it: apt install g++")


def _pip(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments], check=True)


def _generate(package: str, interfaces: Iterable[Path], folder: Path) -> None:
    """Write the sources of a package's interfaces into its folders."""
    from rosidl_adapter.action import convert_action_to_idl
    from rosidl_adapter.msg import convert_msg_to_idl
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_generator_type_description.cli import HashTypeDescription
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    # The command `rosidl generate` would do all this, but takes each of PyPI's generators for two.
    output = folder / package
    converters = {".msg": convert_msg_to_idl, ".action": convert_action_to_idl}
    idls = [
        converters[interface.suffix](SOURCES / package, package, interface, output / interface.parent)
        for interface in interfaces
    ]
    job = (package, [f"{output}:{idl.relative_to(output)}" for idl in idls], [str(PREFIX / "share")], output)
    hashes = HashTypeDescription("type_description").generate_type_hashes(*job)
    GenerateC("c").generate(*job, hashes)
    GenerateFastRTPSCTypesupport("fastrtps_c").generate(*job)
    # In a folder of its own: its type_support.c would replace that of GenerateC.
    GenerateIntrospectionCTypesupport("introspection_c").generate(*job[:3], folder / "introspection" / package)
    GenerateCTypesupport("c", typesupport_implementations=TYPESUPPORTS).generate(*job)
    GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]).generate(*job)
    (output / "__init__.py").touch()


def _libraries(package: str, headers: Iterable[Path]) -> list[str]:
    """Compile a package's type supports; return the libraries that Fast DDS opens by name.

    All are in the first library; the second is empty, but needs the first, where its symbols are found.
    """
    first, second = (f"lib{package}__{typesupport}.so" for typesupport in TYPESUPPORTS)
    sources = sorted(path for path in Path().rglob(f"{package}/**/*__*") if path.suffix in (".c", ".cpp"))
    includes = [f"-I{folder}" for folder in headers]
    shared = ["cc", "-shared", "-fPIC", "-O1", "-L", str(PREFIX / "lib"), "-L."]
    links = [f"-l{library}" for library in (*LIBRARIES, "stdc++")]
    subprocess.run([*shared, *includes, "-o", first, f"-Wl,-soname,{first}", *map(str, sources), *links], check=True)
    subprocess.run([*shared, "-o", second, f"-Wl,-soname,{second},--no-as-needed", f"-l:{first}"], check=True)
    return [first, second]


def _listed(package: str) -> str:
    """Write the list of a package's interfaces by which ROS 2 knows that they are installed; return its path."""
    listed = Path("index") / package
    listed.parent.mkdir(exist_ok=True)
    listed.write_text("".join(f"{path}\n" for name, path in _interfaces() if name == package))
    return str(listed)


def _wheel(folder: Path, wheel_version: str) -> Path:
    import numpy as np
    from setuptools import Extension, find_packages, setup

    packages = sorted({package for package, _ in _interfaces()})
    # Where the generators find their templates.
    os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)
    # The generators tell of each file they write.
    with redirect_stdout(StringIO()):
        for package, found in groupby(_interfaces(), itemgetter(0)):
            _generate(package, [interface for _, interface in found], folder)
    os.chdir(folder)
    installed = [path for path in (PREFIX / "include").iterdir() if path.is_dir()]
    headers = [folder, folder / "introspection", PREFIX / "include", *installed, Path(np.get_include())]
    libraries = {package: _libraries(package, headers) for package in packages}
    extensions = [
        Extension(
            f"{package}.{package}_s__rosidl_typesupport_c",
            [str(path) for path in sorted(Path(package).rglob("_*.c"))],
            include_dirs=list(map(str, headers)),
            library_dirs=[str(folder), str(PREFIX / "lib")],
            libraries=[f"{package}__{TYPESUPPORTS[0]}", *LIBRARIES],
            extra_compile_args=["-O1"],
        )
        for package in packages
    ]
    # What is deprecated is installing by setup.py; making a wheel uses that command inside.
    warnings.filterwarnings("ignore", "setup.py install is deprecated")
    setup(
        name=DISTRIBUTION,
        version=wheel_version,
        packages=find_packages("."),
        ext_modules=extensions,
        data_files=[
            ("lib", [library for package in packages for library in libraries[package]]),
            (INDEX, [_listed(package) for package in packages]),
        ],
        script_args=["--quiet", "bdist_wheel", "--dist-dir", "dist"],
    )
    (wheel,) = (folder / "dist").glob("*.whl")
    return wheel


if __name__ == "__main__":
    main(sys.argv[1:])
