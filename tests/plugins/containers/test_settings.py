"""Engines that would ignore limits, and what a container is asked to be limited to."""

from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers import settings
from benchbot.plugins.containers.engine import Engine
from benchbot.submission.limits import with_defaults
from benchbot.submission.modes import ProcessLimits

ALL = {"MemoryLimit": True, "PidsLimit": True, "CpuCfsQuota": True, "CgroupVersion": "2"}


def engine(name: str = "docker", *, rootless: bool = False, **information: Any) -> Engine:
    return Engine("unix:///engine.sock", name, rootless, {**ALL, **information}, "1.41")


@pytest.mark.parametrize(
    ("asked", "ignored"),
    [
        (engine(), []),
        (engine("podman", rootless=True), []),
        (engine("podman", rootless=True, CgroupVersion="1"), ["memory", "processes"]),
        (engine(CpuCfsQuota=False), []),
        (engine("podman", CgroupVersion="1"), []),
        (engine(PidsLimit=False), ["processes"]),
    ],
)
def test_limits_that_would_be_ignored_are_refused_unless_allowed(asked: Engine, ignored: list[str]) -> None:
    assert settings.check_limits(asked, allowed=True) == ignored
    if not ignored:
        assert settings.check_limits(asked, allowed=False) == []
        return
    with pytest.raises(BenchbotError, match=f"limits would not hold: {', '.join(ignored)}") as raised:
        settings.check_limits(asked, allowed=False)
    assert "--weak-limits" in raised.value.fix


def test_a_limit_on_processors_is_refused_only_if_there_is_to_be_one() -> None:
    with pytest.raises(BenchbotError, match="limits would not hold: processors"):
        settings.check_limits(engine(CpuCfsQuota=False), allowed=False, processors=2.0)


def configured(asked: Engine, limits: ProcessLimits | None = None, **options: Any) -> dict[str, Any]:
    limits = with_defaults(limits or ProcessLimits())
    return settings.host_config(asked, limits, Path("/s.sock"), Path("/outbox"), **options)


def test_what_a_container_is_asked_to_be_limited_to() -> None:
    asked = configured(engine(), ProcessLimits(memory_bytes=2**28, processes=7, cpu_time_s=9), processors=1.5)
    assert (asked["Memory"], asked["MemorySwap"], asked["PidsLimit"], asked["NanoCpus"]) == (2**28, 2**28, 7, 1.5e9)
    limits = {limit["Name"]: (limit["Soft"], limit["Hard"]) for limit in asked["Ulimits"]}
    assert limits["cpu"] == (9, 10)
    assert limits["core"] == (0, 0)
    assert "as" not in limits
    weak = configured(engine(), ignored=["memory", "processes", "processors"], processors=1.5)
    assert not {"Memory", "PidsLimit", "NanoCpus"} & set(weak)
    of_each = {limit["Name"]: limit["Hard"] for limit in weak["Ulimits"]}
    assert (of_each["data"], of_each["nproc"]) == (8 * 2**30, 512)


def test_gpus_are_given_only_where_they_can_be_asked_for() -> None:
    assert "DeviceRequests" not in configured(engine())
    (asked,) = configured(engine(), gpus=2)["DeviceRequests"]
    assert (asked["Count"], asked["Capabilities"]) == (2, [["gpu"]])
    with pytest.raises(BenchbotError, match="podman cannot be asked for GPUs"):
        configured(engine("podman"), gpus=1)


def test_podman_filters_what_a_sandbox_refuses_and_keeps_the_rest(tmp_path: Path) -> None:
    names = ["read", "unshare", "clone", "clone3", "mount", "socket", "socketpair", "socketcall"]
    allowed = {"names": names, "action": "SCMP_ACT_ALLOW", "args": []}
    errors = {"names": ["userfaultfd", "socket"], "action": "SCMP_ACT_ERRNO"}
    native = {"architecture": "SCMP_ARCH_X86_64"}
    tables = [{**native, "subArchitectures": ["SCMP_ARCH_X86", "SCMP_ARCH_X32"]}]
    profile = {"defaultAction": "SCMP_ACT_ERRNO", "archMap": tables, "syscalls": [allowed, errors]}

    stricter = settings.stricter_profile(profile)

    assert stricter["archMap"] == [native]
    read, kept, clone, unix, others = stricter["syscalls"]
    assert read == {**allowed, "names": ["read"]}
    assert kept == {**errors, "names": ["userfaultfd"]}
    assert (clone["names"], clone["args"][0]["op"]) == (["clone"], "SCMP_CMP_MASKED_EQ")
    assert (unix["action"], unix["args"][0]["op"]) == ("SCMP_ACT_ALLOW", "SCMP_CMP_EQ")
    assert (others["action"], others["args"][0]["op"]) == ("SCMP_ACT_ERRNO", "SCMP_CMP_NE")
    assert settings.write_seccomp_profile(engine("docker"), tmp_path / "none") is None
