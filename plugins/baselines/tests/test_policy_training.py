"""Training of the policy that drives to a point: what of it needs no environment."""

from pathlib import Path

import numpy as np
import pytest
import torch

from benchbot.plugin import BenchbotError
from benchbot_baselines.navigation import WEIGHTS
from benchbot_baselines.policy_network import CROP, KNOWN, Network, read_onnx, to_onnx
from benchbot_baselines.policy_training import Options, Rollout, learn, train
from benchbot_baselines.practice import COURSE


def seen(count: int) -> tuple[torch.Tensor, torch.Tensor]:
    random = torch.Generator().manual_seed(1)
    return torch.rand(count, 2, 4, CROP, CROP, generator=random), torch.rand(count, KNOWN, generator=random)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::torch.jit.TracerWarning")
def test_a_policy_is_gone_on_with_from_its_file(tmp_path: Path) -> None:
    torch.manual_seed(0)
    network, again = Network(), Network()
    to_onnx(network, tmp_path / "point_goal.onnx")
    read_onnx(again, tmp_path / "point_goal.onnx")

    with torch.no_grad():
        assert torch.allclose(again(*seen(4))[0], network(*seen(4))[0], atol=1e-3)


def test_the_policy_that_is_shipped_can_be_gone_on_with() -> None:
    network = Network()
    read_onnx(network, WEIGHTS)
    logits, _ = network(*seen(1))
    assert logits.abs().max() > 1  # it has learnt: a new one's are near zero


def test_a_file_that_is_no_policy_is_refused(tmp_path: Path) -> None:
    (tmp_path / "broken.onnx").write_bytes(b"no network")
    with pytest.raises(BenchbotError, match="is no policy to begin from"):
        read_onnx(Network(), WEIGHTS.with_name("segmenter.onnx"))
    with pytest.raises(BenchbotError, match=r"broken\.onnx cannot be read"):
        read_onnx(Network(), tmp_path / "broken.onnx")
    with pytest.raises(BenchbotError, match=r"nothing\.onnx cannot be read"):
        read_onnx(Network(), tmp_path / "nothing.onnx")


def test_a_run_that_has_a_policy_does_not_begin_from_another(tmp_path: Path) -> None:
    (tmp_path / "places" / "practice2001").mkdir(parents=True)
    course = tmp_path / "places" / "practice2001" / COURSE
    np.savez(course, distances_m=np.zeros((1, 2, 2)), origin_xy=np.zeros(2), resolution_m=0.05)
    (tmp_path / "point_goal.pt").touch()
    with pytest.raises(BenchbotError, match=r"There is a policy in .* already"):
        train(tmp_path / "places", tmp_path, Options(), "cpu", WEIGHTS)


@pytest.mark.parametrize("is_critic_alone", [True, False])
def test_a_critic_that_knows_nothing_yet_learns_alone(is_critic_alone: bool) -> None:
    torch.manual_seed(0)
    network = Network()
    before = {name: value.clone() for name, value in network.named_parameters()}
    crops, known = (each.reshape(2, 4, *each.shape[1:]) for each in seen(8))
    taken = Rollout(
        crops=crops,
        known=known,
        actions=torch.tensor([[0, 1, 2, 0], [1, 2, 0, 1]]),
        likely=torch.full((2, 4), -1.1),
        values=torch.zeros(2, 4),
        rewards=torch.rand(2, 4),
        ended=torch.zeros(2, 4),
        after=torch.zeros(4),
    )

    learn(network, torch.optim.Adam(network.parameters()), taken, 0.01, 1, is_critic_alone=is_critic_alone)

    changed = {name for name, value in network.named_parameters() if not torch.equal(value, before[name])}
    assert changed == ({"critic.weight", "critic.bias"} if is_critic_alone else set(before))
