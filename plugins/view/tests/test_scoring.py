"""The process that scores results beside the server."""

import subprocess
import sys

import psutil

SERVER = """
import os, time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from benchbot_view.scoring import begin

if __name__ == "__main__":
    with ProcessPoolExecutor(1, get_context("spawn"), initializer=begin) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        pool.submit(time.sleep, 600).result()
"""


def test_it_ends_with_a_server_that_is_killed() -> None:
    with subprocess.Popen([sys.executable, "-c", SERVER], stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        scoring = psutil.Process(int(server.stdout.readline()))
        assert scoring.is_running()

        server.kill()

        _, alive = psutil.wait_procs([scoring], timeout=60)
    assert alive == []
