"""The filter of system calls that containers run under, where the engine's own lets too much through.

podman's lets everybody make namespaces, which is of use to containers in containers, and to nobody else. docker's does
not.
"""

import json
from pathlib import Path
from typing import Any

from benchbot.plugins.containers.engine import Engine
from benchbot.plugins.sandbox.syscalls import NEW_NAMESPACES, REFUSED

PROFILES = (Path("/etc/containers/seccomp.json"), Path("/usr/share/containers/seccomp.json"))
"""Where podman looks for its filter (containers.conf(5), `seccomp_profile`)."""


def write(engine: Engine, path: Path) -> Path | None:
    """Write podman's filter without what a sandbox refuses, too; None where the engine's own is to be used."""
    if engine.name != "podman":
        return None
    usual = next((profile for profile in PROFILES if profile.is_file()), None)
    if usual is None:
        return None
    path.write_text(json.dumps(stricter(json.loads(usual.read_text("utf-8")))), "utf-8")
    return path


def stricter(profile: dict[str, Any]) -> dict[str, Any]:
    """Return a filter (OCI runtime specification, `seccomp`) that allows no more than a sandbox does."""
    refused = {*REFUSED, "clone", "clone3"}
    rules = []
    for rule in profile["syscalls"]:
        allowed = rule["action"] == "SCMP_ACT_ALLOW"
        names = [name for name in rule["names"] if not (allowed and name in refused)]
        rules.append({**rule, "names": names})
    # Of clone3 no filter sees the flags: unknown, it is replaced by clone.
    same = {"index": 0, "value": NEW_NAMESPACES, "valueTwo": 0, "op": "SCMP_CMP_MASKED_EQ"}
    rules.append({"names": ["clone"], "action": "SCMP_ACT_ALLOW", "args": [same]})
    return {**profile, "syscalls": [rule for rule in rules if rule["names"]]}
