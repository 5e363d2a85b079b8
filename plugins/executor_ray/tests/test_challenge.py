"""A challenge whose submissions are computed on a cluster."""

from pathlib import Path

import pytest

from plugins.executor_ray.tests.cluster import ENVIRONMENT, Cluster
from tests import batches
from tests.plugins.challenge.clusters import computed_on

pytestmark = [pytest.mark.xdist_group("ray"), pytest.mark.slow]


def test_a_submission_is_computed_by_ray(ray_cluster: Cluster, tmp_path: Path) -> None:
    variables = batches.environment(**ENVIRONMENT, RAY_ADDRESS=ray_cluster.address)
    row, log = computed_on(ray_cluster.head, tmp_path, {"executor": "ray"}, variables)
    assert (row.state, row.attempt) == ("scored", 1), log
