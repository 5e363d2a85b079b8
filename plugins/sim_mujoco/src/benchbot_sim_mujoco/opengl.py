"""OpenGL without a display: through EGL, or OSMesa where EGL is not installed."""

import ctypes
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError

LIBRARIES = {"egl": "libEGL.so.1", "osmesa": "libOSMesa.so.8"}
"""The ways to draw without a display, and the library of each, the first choice first."""
INSTALL = "Install one: sudo apt-get install libegl1 libegl-mesa0 (or libosmesa6)."

SURFACE_PIXELS = 16
"""Of a surface that nothing is drawn on: pictures have buffers of their own."""


def way() -> str | None:
    """Return the way to draw here, one of `LIBRARIES`, None where there is none; MUJOCO_GL chooses among both."""
    asked = os.environ.get("MUJOCO_GL", "").strip().lower()
    return next((name for name in LIBRARIES if asked in ("", name) and _is_installed(name)), None)


def described(options: Mapping[str, Any]) -> str:
    """Return the device in words; raises BenchbotError for any but the processor."""
    asked = str(options.get("device", "auto"))
    if asked not in ("auto", "cpu"):
        raise BenchbotError(
            f"MuJoCo does not simulate on '{asked}' here.",
            "Physics and rays are computed on the processor; pictures are drawn by OpenGL.",
            "Leave --device out, or choose cpu.",
        )
    found = way()
    return f"cpu, pictures by OpenGL through {found.upper()}" if found else "cpu, without pictures"


def try_out(cache_dir: Path) -> str:
    """Start OpenGL; return what draws. There is nothing to keep in the folder."""
    import mujoco

    made = context()
    name = renderer_name()
    made.free()
    return f"pictures are drawn by {name}; MuJoCo {mujoco.__version__}"


def context() -> Any:
    """Return a new OpenGL context, which is current; raises BenchbotError where nothing can be drawn."""
    name = way()
    if name is None:
        asked = os.environ.get("MUJOCO_GL")
        raise BenchbotError(
            "MuJoCo cannot draw pictures here.",
            f"MUJOCO_GL asks for '{asked}', which is not here."
            if asked
            else f"There is neither {' nor '.join(LIBRARIES.values())}.",
            f"{INSTALL} Laser and motion work without." + (" Or unset MUJOCO_GL." if asked else ""),
        )
    os.environ["MUJOCO_GL"] = name
    try:
        if name == "egl":
            from mujoco.egl import GLContext
        else:
            from mujoco.osmesa import GLContext
        made = GLContext(SURFACE_PIXELS, SURFACE_PIXELS)
        made.make_current()
    except (ImportError, AttributeError, RuntimeError) as error:
        raise BenchbotError("MuJoCo cannot draw pictures here.", f"{type(error).__name__}: {error}", INSTALL) from error
    return made


def renderer_name() -> str:
    """Return the name and version of what draws, of which pictures depend to the byte."""
    from OpenGL import GL

    return " ".join(GL.glGetString(what).decode() for what in (GL.GL_RENDERER, GL.GL_VERSION))


def _is_installed(name: str) -> bool:
    try:
        ctypes.CDLL(LIBRARIES[name])
    except OSError:
        return False
    return True
