"""What denoising leaves as it was."""

import numpy as np
import pytest

from benchbot_sim_taichi.denoise import denoise


def test_of_each_colour_there_is_as_much_as_in_the_samples() -> None:
    """The network alone adds 0.5 % of blue here, and takes 0.1 % of red."""
    albedo = np.broadcast_to(np.array([0.3, 0.5, 0.4], np.float32), (128, 128, 3)).copy()
    normal = np.broadcast_to(np.array([0.0, 0.0, 1.0], np.float32), (128, 128, 3)).copy()
    light = np.random.default_rng(0).exponential(1.0, (128, 128, 1)).astype(np.float32)

    denoised = denoise(albedo * light, albedo, normal)

    assert denoised.std(axis=(0, 1)).max() < 0.1 * (albedo * light).std(axis=(0, 1)).min()
    assert denoised.mean(axis=(0, 1)) == pytest.approx((albedo * light).mean(axis=(0, 1)), rel=1e-3)


def test_one_bright_sample_does_not_light_the_whole_picture() -> None:
    picture = np.full((64, 64, 3), 0.2, np.float32)
    normal = np.broadcast_to(np.array([0.0, 0.0, 1.0], np.float32), picture.shape).copy()
    with_spot = picture.copy()
    with_spot[30, 30] = 5000.0

    denoised = denoise(with_spot, picture, normal)

    assert denoised[:8].mean() == pytest.approx(0.2, rel=0.03)
