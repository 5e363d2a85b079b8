"""What a bundle says of itself in words."""

import shlex
from collections.abc import Mapping
from typing import Any

from benchbot.core import overrides
from benchbot.plugins.bundles.command import CONTAINER


def text(manifest: Mapping[str, Any]) -> str:
    """Return a bundle's README: what was run, on what, what came of it, and how to run it again."""
    solution, software = manifest["solution"], manifest["software"]
    plugins = [f"{plugin}=={used['version']}" for plugin, used in software["plugins"].items()]
    packages = [plugin for plugin in plugins if not plugin.endswith("==v2")]
    lines = [
        "# A solution and its results",
        "",
        f"Made by BenchBot {manifest['benchbot']}. To make the results again, elsewhere:",
        "",
        "```",
        f"benchbot install {' '.join(packages)}",
        "benchbot reproduce BUNDLE.zip",
        "```",
        "",
        f"The solution is in `solution/`, and ran there {_how(solution)}"
        + (f", at git revision {solution['git_revision']}" if "git_revision" in solution else "")
        + (" with changes that were not committed." if solution.get("git_dirty") else "."),
        "It is somebody's program: `benchbot reproduce` confines it. What else it needs is yours to install.",
        "",
        "| result | task | robot | environment | seed | settings | ended |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in manifest["results"]:
        chosen = row["selection"]
        settings = overrides.label(chosen.get("settings") or {}) or "-"
        cells = (row["file"], chosen["task"], chosen["robot"], chosen["environment"], chosen["seed"], settings)
        lines.append(f"| {' | '.join(map(str, cells))} | {row['failure'] or 'well'} |")
    scores = manifest["scores"]
    if scores is not None:
        score = "none" if scores["score"] is None else f"{scores['score']:.4f}"
        lines += ["", f"Scored with `{scores['method']}`: {scores['headline']} {score} (`scores.json`)."]
    lines += [
        "",
        "`manifest.json` names every file with its SHA-256, every plug-in with version and content.",
        "",
    ]
    return "\n".join(lines)


def _how(solution: Mapping[str, Any]) -> str:
    if solution["mode"] == CONTAINER:
        words = shlex.join(solution["command"])
        return "in a container of its Dockerfile" + (f", which was given `{words}`" if words else "")
    return f"as `{shlex.join(solution['command'])}`"
