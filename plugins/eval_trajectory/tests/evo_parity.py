"""How far our numbers are from those of evo (github.com/MichaelGrupp/evo), for the same files.

`python -m plugins.eval_trajectory.tests.evo_parity FOLDER` does it for evo's own test data, which its source
distribution has in `test/data`.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from evo.core import metrics as evo
from evo.core import sync
from evo.core.metrics import PoseRelation, Unit
from evo.core.trajectory import PosePath3D, PoseTrajectory3D
from evo.tools import file_interface

from benchbot_eval_trajectory import comparison, files
from benchbot_eval_trajectory.alignment import Align

OWN_DATA = (
    ("freiburg1_xyz-rgbdslam.txt", "freiburg1_xyz-groundtruth.txt", 1.0),
    ("freiburg1_xyz-rgbdslam_drift.txt", "freiburg1_xyz-groundtruth.txt", 1.0),
    ("freiburg1_xyz-ORB_kf_mono.txt", "freiburg1_xyz-groundtruth.txt", 1.0),
    ("fr2_desk_ORB.txt", "fr2_desk_groundtruth.txt", 1.0),
    ("fr2_desk_ORB_kf_mono.txt", "fr2_desk_groundtruth.txt", 1.0),
    ("KITTI_00_ORB.txt", "KITTI_00_gt.txt", 100.0),
    ("KITTI_00_SPTAM.txt", "KITTI_00_gt.txt", 100.0),
)
NAMES = {"rmse": evo.StatisticsType.rmse, "mean": evo.StatisticsType.mean, "median": evo.StatisticsType.median}
NAMES["max"] = evo.StatisticsType.max


def differences(estimate: Path, truth: Path, align: Align, length_m: float) -> Iterator[tuple[str, float, float]]:
    """Yield the name of each error, our number and evo's."""
    found = comparison.compare(files.read(estimate), files.read(truth), align=align, length_m=length_m)
    theirs, reference = _evo_pair(estimate, truth)
    if align is not Align.NONE:
        theirs.align(reference, correct_scale=align is Align.SIM3)
    by_path = {"delta": length_m, "delta_unit": Unit.meters, "pairs_from_reference": True}
    judged = {
        "ATE_m": evo.APE(PoseRelation.translation_part),
        "RPE_m": evo.RPE(PoseRelation.translation_part, **by_path),
        "RPE_deg": evo.RPE(PoseRelation.rotation_angle_deg, **by_path),
        "RPE_frame_m": evo.RPE(PoseRelation.translation_part, delta=1, delta_unit=Unit.frames),
        "RPE_frame_deg": evo.RPE(PoseRelation.rotation_angle_deg, delta=1, delta_unit=Unit.frames),
    }
    for name, judge in judged.items():
        judge.process_data((reference, theirs))
        for key, statistic in NAMES.items():
            yield f"{name} {key}", found["errors"][name][key], float(judge.get_statistic(statistic))
        yield f"{name} count", found["errors"][name]["count"], len(np.atleast_1d(judge.error))


def _evo_pair(estimate: Path, truth: Path) -> tuple[PosePath3D, PosePath3D]:
    if files.read(truth).times_s is None:
        return file_interface.read_kitti_poses_file(estimate), file_interface.read_kitti_poses_file(truth)
    pair: tuple[PoseTrajectory3D, PoseTrajectory3D] = (
        file_interface.read_tum_trajectory_file(estimate),
        file_interface.read_tum_trajectory_file(truth),
    )
    reference, theirs = sync.associate_trajectories(pair[1], pair[0], max_diff=0.01)
    return theirs, reference


def main(folder: Path) -> None:
    """Print the largest difference for each pair of files and alignment."""
    for estimate, truth, length_m in OWN_DATA:
        for align in Align:
            found = list(differences(folder / estimate, folder / truth, align, length_m))
            name, ours, theirs = max(found, key=lambda item: abs(item[1] - item[2]))
            ate = found[0][1]
            print(f"{estimate} {align}: ATE {ate:.6f} m; largest difference {abs(ours - theirs):.1e} ({name})")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
