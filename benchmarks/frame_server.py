"""Takes pictures when it is asked to, with the BenchBot that it imports: `bench_frames` starts one for each commit.

python benchmarks/frame_server.py CACHE DEVICE ROBOT

It imports nothing else of the benchmarks, and answers each line of JSON with one: [environment, place of the
trajectory] loads that, to the first picture; null takes one. Both are answered by wall and processor seconds.
"""

import json
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import benchbot_sim_taichi
from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_sim_taichi.simulator import RayTracedSimulator

CHANNELS = ("image_rgb", "image_depth", "image_segment")
WARM_UP = 2  # pictures after the first


def main() -> None:
    cache, device, robot = sys.argv[1:4]
    answers = sys.stdout
    sys.stdout = sys.stderr
    catalog = Catalog(plugin_manager.load())
    # The option's name has changed.
    options = {"device" if find_spec("benchbot_sim_taichi.devices") else "arch": device}
    simulator = RayTracedSimulator(
        PlatformSpec(catalog.get("robots", robot).data, "ground_truth", Path(cache), options)
    )
    print(json.dumps(benchbot_sim_taichi.__file__), file=answers, flush=True)
    for line in sys.stdin:
        asked = json.loads(line)
        started_s, spent_s = time.perf_counter(), time.process_time()
        if asked is None:
            simulator.observe(CHANNELS)
        else:
            name, place = asked
            (environment,) = catalog.environments(name)
            scene = Scene(environment.data, environment.path.parent)
            simulator.close()
            simulator.load(scene, 0)
            simulator.place(scene.trajectory[place])
            simulator.observe(CHANNELS)
        print(json.dumps([time.perf_counter() - started_s, time.process_time() - spent_s]), file=answers, flush=True)
        for _ in range(WARM_UP if asked is not None else 0):
            simulator.observe(CHANNELS)


if __name__ == "__main__":
    main()
