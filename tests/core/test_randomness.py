"""Whoever knows the seed, the code and other streams cannot tell what is drawn under a secret; who knows all can."""

import hashlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core import randomness
from benchbot.core.errors import BenchbotError

SECRET = 16 * "0f"
SECRETS = st.binary(min_size=16, max_size=40).map(bytes.hex)
SEEDS = st.integers(0, 2**63 - 1)
STREAMS = st.tuples(st.sampled_from(["odometry", "laser", "image_rgb"]), st.integers(0, 10**6))


@given(SECRETS, SEEDS, STREAMS)
def test_equal_keys_give_equal_bytes(secret: str, seed: int, stream: tuple[str, int]) -> None:
    one, other = (randomness.generator(randomness.scene_seed(secret, seed, 0), *stream).bytes(16) for _ in range(2))
    assert one == other


def test_each_secret_seed_scene_stream_and_instant_has_numbers_of_its_own() -> None:
    seeds = [
        randomness.scene_seed(secret, seed, scene)
        for secret in ("", SECRET, 16 * "f0", 17 * "0f")
        for seed in (0, 2)
        for scene in (0, 1)
    ]
    streams = [("odometry", 0), ("odometry", 1), ("laser", 0), ("laser", 11), ("laser1", 1)]
    drawn = {randomness.generator(seed, *stream).bytes(16) for seed in seeds for stream in streams}
    assert len(drawn) == len(seeds) * len(streams)


def test_without_a_secret_a_platform_gets_the_seed_itself() -> None:
    assert [randomness.scene_seed("", 7, scene) for scene in range(3)] == [7, 8, 9]


@given(SECRETS, SEEDS)
def test_with_a_secret_it_gets_a_key_of_256_bits(secret: str, seed: int) -> None:
    found = randomness.scene_seed(secret, seed, 0)
    assert found == randomness.key(secret, seed, "scene", 0) < 2**256
    assert found > 2**180  # as likely as drawing the same 76 bits twice


def test_the_commitment_is_what_sha256sum_prints() -> None:
    assert randomness.commitment(SECRET, 3) == hashlib.sha256(f"{SECRET} 3\n".encode()).hexdigest()


@given(SECRETS)
def test_a_secret_is_read_as_it_was_written(tmp_path_factory: pytest.TempPathFactory, secret: str) -> None:
    path = tmp_path_factory.mktemp("secrets") / "secret.txt"
    path.write_text(f"  {secret.upper()}\n")
    assert randomness.read_secret(path) == secret


@pytest.mark.parametrize(
    "content", [b"", b"0f", b"0" * 31, b"0" * 33, b"x" * 32, b"\xff" * 32, b"0" * 16 + b" " + b"0" * 16]
)
def test_what_is_no_secret_is_refused_and_not_shown(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "secret.txt"
    path.write_bytes(content)
    with pytest.raises(BenchbotError, match="There is no secret in") as caught:
        randomness.read_secret(path)
    assert "token_hex" in caught.value.fix
    assert content.decode("latin-1").strip("\0") not in str(caught.value) or len(content) < 3


def test_a_secret_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="No such file"):
        randomness.read_secret(tmp_path / "none.txt")


def test_new_secrets_are_secrets_and_differ() -> None:
    drawn = {randomness.new_secret() for _ in range(20)}
    assert len(drawn) == 20
    assert all(map(randomness.is_secret, drawn))
