"""A new challenge: a declaration that runs at once, rules, secrets and a key; and its baselines."""

import os
import re
import shutil
from pathlib import Path

from benchbot.core import atomic
from benchbot.core.errors import BenchbotError
from benchbot.core.randomness import new_secret
from benchbot.plugins.challenge import document, people, signing
from benchbot.plugins.challenge.document import FILE, PLACES_SECRET, RUNS_SECRET, SIGNING_KEY, Challenge

ORGANISER_TOKEN = "organiser.token"  # noqa: S105 - a file's name
DECLARATION = """\
# A challenge. Every key: benchbot schema challenge. What is wrong with it: benchbot check {file}
version: 1
name: {name}
title: {title}
organiser: ""
rules: rules.md
teams: {{signed: false}}
uploads: {{largest: 256MiB}}
phases:
  development:
    title: Development
    batch: # as in a batch file, without a solution: benchbot schema batch
      task: semantic_slam:passive:ground_truth:segmentation
      robots: [carter_lowres]
      environments: ["miniroom:1"]
      evaluate_with: omq
      timeout_s: 600
      record: [frames] # of which some are shown beside the leaderboard
    quota: {{per_day: 10}}
  # Places that nobody knows, drawn from places.secret, with noise from runs.secret:
  #   benchbot generate-environment --kind apartment --rooms 3 --seed 1 --secret {file_folder}/places.secret \\
  #     --name place1 --robot carter_lowres --output-location {file_folder}/places/place1
  # test:
  #   title: Test
  #   opens: "2027-03-01T00:00:00Z"
  #   closes: "2027-04-01T00:00:00Z"
  #   hidden: true
  #   addons: [places/place1, places/place2, places/place3, places/place4, places/place5, places/place6]
  #   batch:
  #     task: semantic_slam:passive:ground_truth:segmentation
  #     robots: [carter_lowres]
  #     environments: ["place1:1", "place2:1", "place3:1", "place4:1", "place5:1", "place6:1"]
  #     evaluate_with: omq
  #     timeout_s: 3600
  #   quota: {{per_day: 1, in_all: 10}}
"""
RULES = """\
Hand in a program; it runs in a sandbox, without network, in each place of the phase.

- A solution that crashes, hangs or takes too much counts as zero there.
- The robot is not put back after a collision.
- Training on the shipped environments and on generated ones is allowed.
"""


def make(folder: Path, title: str) -> Challenge:
    """Make a challenge in a new folder; raises BenchbotError where there is something already."""
    if folder.exists() and any(folder.iterdir()):
        raise BenchbotError(f"{folder} is not empty.", "A challenge is made whole.", "Name a new folder.")
    name = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")[:63] or "challenge"
    atomic.write_text(folder / "rules.md", RULES)
    for secret in (PLACES_SECRET, RUNS_SECRET):
        _write_private(folder / secret, f"{new_secret()}\n")
    _write_private(folder / ORGANISER_TOKEN, f"{people.new_token()}\n")
    signing.make(folder / SIGNING_KEY)
    written = DECLARATION.format(name=name, title=_quoted(title), file=folder / FILE, file_folder=folder)
    atomic.write_text(folder / FILE, written)
    return document.read(folder)


def discard_work(challenge: Challenge, identifier: str) -> None:
    """Remove what was computed of a submission, so that it is computed from nothing."""
    shutil.rmtree(challenge.work / identifier, ignore_errors=True)


def _write_private(path: Path, text: str) -> None:
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
        file.write(text)


def _quoted(text: str) -> str:
    import json

    return json.dumps(text, ensure_ascii=False)
