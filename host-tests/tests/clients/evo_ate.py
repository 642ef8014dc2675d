"""Prints evo's absolute trajectory error in the plane of two TUM files as JSON: rmse and mean, as they lie and aligned."""

import copy
import json
import sys

from evo.core import metrics, sync
from evo.core.trajectory import Plane
from evo.tools import file_interface

truth, estimate = map(file_interface.read_tum_trajectory_file, sys.argv[1:])
truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=0.001)
aligned = copy.deepcopy(estimate)
aligned.align(truth, correct_scale=False)
result = {"poses": truth.num_poses}
for name, trajectory in (("ate", estimate), ("aligned_ate", aligned)):
    pair = copy.deepcopy(truth), trajectory
    for path in pair:
        path.project(Plane.XY)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data(pair)
    result[f"{name}_m"] = float(error.get_statistic(metrics.StatisticsType.rmse))
    result[f"{name}_mean_m"] = float(error.get_statistic(metrics.StatisticsType.mean))
print(json.dumps(result))
