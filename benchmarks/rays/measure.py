"""Timing jobs in turn, so that whatever else the machine does hits all of them alike."""

import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.rays.peers.job import Job

PAUSE_S = 0.02  # other programs' threads spin for a moment after their work; nobody else should pay for that


@dataclass(frozen=True)
class Figure:
    """One program's speed at one question, millions of rays (or samples) a second, and ours divided by it.

    By wall clock, and per second of processor time of all threads. Medians; ratios are the median of each round's.
    `same` is the share of answers that equal ours, for `path` the relative difference of mean radiance from ours.
    """

    triangles: int
    measure: str
    program: str
    wall_m_per_s: float
    processor_m_per_s: float
    ours_over_it_wall: float
    ours_over_it_processor: float
    same: float


def timed(job: Job) -> tuple[object, float, float]:
    """Result, wall seconds and processor seconds of one run."""
    time.sleep(PAUSE_S)
    wall, processor = time.perf_counter(), time.process_time()
    answer = job.run()
    return answer, time.perf_counter() - wall, time.process_time() - processor


def interleave(jobs: Sequence[Job], rounds: int, triangles: int) -> list[Figure]:
    """Run every job once unmeasured, then all of them in each of the rounds."""
    answers = [job.read(job.run()) for job in jobs]
    wall, processor = np.zeros((2, rounds, len(jobs)))
    for number in range(rounds):
        for column, job in enumerate(jobs):
            _, wall[number, column], processor[number, column] = timed(job)
    first = {job.measure: column for column, job in reversed(list(enumerate(jobs)))}
    figures = []
    for column, job in enumerate(jobs):
        ours = first[job.measure]
        per_ray_wall, per_ray_processor = (times / [job.work for job in jobs] for times in (wall, processor))
        figures.append(
            Figure(
                triangles,
                job.measure,
                job.peer,
                1e-6 / statistics.median(per_ray_wall[:, column]),
                1e-6 / statistics.median(per_ray_processor[:, column]),
                statistics.median(per_ray_wall[:, column] / per_ray_wall[:, ours]),
                statistics.median(per_ray_processor[:, column] / per_ray_processor[:, ours]),
                _sameness(job.measure, answers[column], answers[ours]),
            )
        )
    return figures


def _sameness(measure: str, theirs: npt.NDArray[np.generic], ours: npt.NDArray[np.generic]) -> float:
    if measure == "path":
        return float(np.mean(theirs.astype(float)) / np.mean(ours.astype(float)) - 1)
    return float(np.mean(theirs == ours))
