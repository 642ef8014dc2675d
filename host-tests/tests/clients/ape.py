"""ATE of planar paths by evo. In: rows "x y ref_x ref_y". Out: rmse, mean, aligned rmse and mean."""

import sys

import numpy as np
from evo.core import metrics
from evo.core.trajectory import PosePath3D


def path(points):
    xyz = np.column_stack([points, np.zeros(len(points))])
    return PosePath3D(positions_xyz=xyz, orientations_quat_wxyz=np.tile([1.0, 0, 0, 0], (len(points), 1)))


def ape(estimate, truth):
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((truth, estimate))
    return [ape.get_statistic(kind) for kind in (metrics.StatisticsType.rmse, metrics.StatisticsType.mean)]


rows = np.loadtxt(sys.stdin)
estimate, truth = path(rows[:, :2]), path(rows[:, 2:])
raw = ape(estimate, truth)
estimate.align(truth, correct_scale=False)
print(*(repr(float(value)) for value in raw + ape(estimate, truth)))
