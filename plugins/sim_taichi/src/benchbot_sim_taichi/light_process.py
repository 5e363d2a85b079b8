"""Working out a scene's light in a process of its own, while this one compiles what takes pictures.

Either takes one thread for seconds, since kernels compile one by one, and neither needs the other. The light comes
back through the cache on disk: a process that dies leaves nothing there, and its light is worked out without it.
"""

import ctypes
import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from benchbot.process import processors
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import _ti, irradiance, lightmap, progress
from benchbot_sim_taichi.lamps import Lamps
from benchbot_sim_taichi.lighting import Lighting

PR_SET_PDEATHSIG = 1


def is_of_use(scene: SceneGeometry, lighting: Lighting, cache_dir: Path, seed: int) -> bool:
    """Return whether light has to be worked out, on a processor that has time for it meanwhile."""
    kept = (module.path_of(scene, lighting, cache_dir, seed) for module in (irradiance, lightmap))
    return _ti.is_on_processor() and processors() > 1 and not all(path.exists() for path in kept)


@contextmanager
def lighting_up(scene: SceneGeometry, lighting: Lighting, cache_dir: Path, seed: int) -> Iterator[None]:
    """Start the process, and wait at the end until it has stored its light; `scene` has its lamps switched."""
    with tempfile.TemporaryFile() as told:
        asked = (scene, replace(lighting, lamps=Lamps()), cache_dir, seed)
        pickle.dump((os.getpid(), *asked), told, pickle.HIGHEST_PROTOCOL)
        told.seek(0)
        command = [sys.executable, "-P", "-m", __name__]
        process = subprocess.Popen(command, stdin=told, stdout=subprocess.PIPE, text=True)
    with process:
        try:
            yield
            for line in process.stdout or ():
                progress.tell(line.rstrip("\n"))
        except BaseException:
            process.kill()
            raise


def main() -> None:
    """Work out the light of the scene on stdin, telling on stdout what is done; ends with the process that asks."""
    # Written by `lighting_up` to a file that nobody else can open.
    asking, scene, lighting, cache_dir, seed = pickle.load(sys.stdin.buffer)  # noqa: S301
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != asking:
            return
    from benchbot_sim_taichi.renderer import Renderer

    progress.listen(lambda text: print(text, flush=True))
    Renderer(scene, lighting, cache_dir=cache_dir, seed=seed).lightmap  # noqa: B018


if __name__ == "__main__":
    main()
