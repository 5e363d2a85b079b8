"""A challenge whose submissions are computed on a cluster: the worker is what waits for it there."""

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from sqlalchemy import Row

from benchbot.core import plugin_manager
from benchbot.plugins.challenge import intake, people, signing, starting, submissions
from benchbot.plugins.challenge.database import Database, url_of
from benchbot.plugins.challenge.document import SIGNING_KEY, read
from benchbot.plugins.challenge.web import uploads
from benchbot.plugins.challenge.web.site import Site
from tests import batches
from tests.cli.solutions import PASSIVE
from tests.machines import Machine
from tests.plugin_factory import PluginFactory
from tests.plugins.batch.test_batch import TRUTHS, truth


def computed_on(
    head: Machine, folder: Path, executor: Mapping[str, Any], environment: Mapping[str, str]
) -> tuple[Row[Any], str]:
    """Hand a submission in to a new challenge; have a worker on a cluster's head compute it; return its row and log."""
    site = folder / "site"
    site.mkdir()
    PluginFactory(site).make("arena-truths", TRUTHS, {"ground_truths/1.json": truth(1)})
    starting.make(folder / "demo", "Demo")
    path = folder / "demo" / "challenge.yaml"
    document = yaml.safe_load(path.read_text("utf-8"))
    batch = {"task": "sample:passive", "robots": ["sample_robot"], "environments": ["arena:1"], "evaluate_with": "omq"}
    document["phases"] = {"development": {"batch": {**batch, **executor}, "modes": ["sandbox"]}}
    path.write_text(yaml.safe_dump(document), "utf-8")
    challenge = read(folder / "demo")
    database = Database(url_of(challenge, None))
    evaluators = {"omq": plugin_manager.load().record("evaluators", "omq")}
    served = Site(challenge, database, signing.load(challenge.folder / SIGNING_KEY), evaluators, "organiser")
    team = people.team_of(database, people.join(database, challenge, people.invite(database), "Ada"))
    assert team is not None
    (folder / "solution").mkdir()
    (folder / "solution" / "solution.py").write_text(PASSIVE)
    intake.pack(folder / "solution", "python solution.py", folder / "packed.zip")
    with uploads.partial(served) as file:
        file.write((folder / "packed.zip").read_bytes())
        file.flush()
        sha256 = intake.sha256_of(folder / "packed.zip")
        made = uploads.accept(served, challenge.phases["development"], team, Path(file.name), sha256, "", None)
    words = [*head.prefix, *batches.BENCHBOT, "challenge", "worker", str(folder / "demo"), "--until-empty"]
    variables = {**environment, "PYTHONPATH": f"{site}:{environment.get('PYTHONPATH', '')}"}
    done = subprocess.run(words, env=variables, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    row = submissions.submission(database, made["id"])
    database.engine.dispose()
    log = (challenge.work / made["id"] / "batch.log").read_text("utf-8")
    return row, log
