"""Results of the same solutions in several simulators: scores side by side, and whether both rank solutions alike.

What differs in more than the simulator is refused or left out: solutions are told by the digests of their files,
episodes by environment, settings and seed.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation import batch_folder, intervals, result_files
from benchbot.evaluation.frames import frame_folders, numbered_frames
from benchbot.evaluation.intervals import Over
from benchbot.evaluation.result_document import ResultDocument, listed
from benchbot.evaluation.result_files import Unreadable
from benchbot.evaluation.score import Options, evaluate_files
from benchbot.plugins.report import channel_differences, comparison, result_sets, scene_pairs
from benchbot.plugins.report.pairing import label, pair
from benchbot.plugins.report.result_sets import ResultSet

if TYPE_CHECKING:
    from numpy.typing import NDArray

Document = dict[str, Any]
Groups = dict[str, dict[str, list[ResultDocument]]]
"""Results by solution and simulator."""
OF_THE_PLACE = {"name", "description", "type", "runs_in", "container", "assets"}
"""Keys of robots' declarations that may differ where only the simulator does."""
MOST_PICTURES = 5
FIX = "Run the same solution, task and places in both: benchbot batch --robots carter,carter_mujoco …"


def across_simulators(texts: Sequence[str], score: str | None, **options: Unpack[Options]) -> Document:
    """Return the table of each pair of simulators in `texts`, which name folders of results, batches or files.

    Raises BenchbotError where results are of one simulator, or are not of the same solutions, task and places.
    """
    catalog, over = options["catalog"], options.get("over", Over.PLACES)
    notes: list[str] = []
    groups = _grouped(texts, catalog, notes)
    simulators = sorted({simulator for group in groups.values() for simulator in group})
    if len(simulators) < 2:
        count = sum(len(results) for group in groups.values() for results in group.values())
        raise BenchbotError(
            "There is no second simulator to compare with.",
            f"All {count} results are of {simulators[0]}." if simulators else "There is no result.",
            FIX,
        )
    for solution, group in groups.items():
        _require_same_solution(solution, group)
    sets = {
        solution: {
            simulator: ResultSet(simulator, evaluate_files([Path(one.source) for one in results], **options))
            for simulator, results in group.items()
        }
        for solution, group in groups.items()
    }
    flat = [one for group in sets.values() for one in group.values()]
    for other in flat[1:]:
        result_sets.require_alike(flat[0], other)
    chosen = score or str(flat[0].document["method"]["headline"])
    for one in flat:
        comparison.require_score(one, chosen)
    evaluator = result_sets.evaluator_of(flat, catalog)
    pairs = []
    for a, b in combinations(simulators, 2):
        both = {
            solution: _alike(group[a], group[b], solution, notes)
            for solution, group in sets.items()
            if {a, b} <= {*group}
        }
        alone = sorted(sets.keys() - both.keys())
        notes += [f"Not in both {a} and {b}, left out: {name}" for name in alone]
        if not both:
            raise BenchbotError(
                f"No solution was run in both {a} and {b}.",
                "; ".join(f"{name or 'the solution'} in {' and '.join(sorted(group))}" for name, group in sets.items()),
                FIX,
            )
        table = scene_pairs.scene_pairs((a, b), both, evaluator, chosen)
        notes += _robot_notes(both, catalog)
        pairs.append(
            {
                **{key: value for key, value in table.items() if key not in ("paired_by", "score")},
                "ranks": None if table["ranks"] is None else {**table["ranks"], **_agreement(table["rows"], over)},
                "scenes": _by_scene(table["rows"]),
                "pictures": sorted(_pictures(catalog, both), key=lambda one: -one["mean_absolute"]),
            }
        )
    return {
        "across": "simulator",
        "task": flat[0].document["task_details"]["name"],
        "score": chosen,
        "lower_is_better": evaluator.score(chosen).lower_is_better,
        "over": over.value,
        "simulators": simulators,
        "pairs": pairs,
        "notes": list(dict.fromkeys(notes)),
    }


def simulator_of(result: ResultDocument, catalog: Catalog) -> str:
    """Return the name of the simulator that a result is of: as its provenance says, or the robot's declaration.

    Raises BenchbotError where neither says it, and for what was replayed or driven by a real robot.
    """
    provenance: Mapping[str, Any] = result.document.get("provenance") or {}
    pool = catalog.plugins.pool("simulators")
    loaded = [name for name, provided in pool.items() if provided.distribution in provenance.get("plugins", {})]
    robot = result.selection.get("robot")
    known = catalog.pool("robots").get(robot) if robot else None
    if result.is_replay:
        raise _no_simulator(result, "It is of a recording, which nothing simulated.")
    if known is not None and known.data["type"] in pool and known.data["type"] in (loaded or pool):
        return str(known.data["type"])
    if len(loaded) == 1:
        return loaded[0]
    if known is not None and known.data["type"] not in pool:
        raise _no_simulator(result, f"Its robot '{robot}' is of type '{known.data['type']}', which is no simulator.")
    raise _no_simulator(result, f"Its robot '{robot}' is not installed." if robot else "It does not name its robot.")


def _no_simulator(result: ResultDocument, why: str) -> BenchbotError:
    return BenchbotError(
        f"Nobody can say which simulator {result.source} is of.",
        why,
        "Leave it out, install the robot, or name the two sets yourself: benchbot compare A=… B=… --paired-by scene",
    )


def _grouped(texts: Sequence[str], catalog: Catalog, notes: list[str]) -> Groups:
    groups: Groups = {}
    for text in texts:
        for solution, result in _read(text, notes):
            groups.setdefault(solution, {}).setdefault(simulator_of(result, catalog), []).append(result)
    return dict(sorted(groups.items()))


def _read(text: str, notes: list[str]) -> Iterator[tuple[str, ResultDocument]]:
    """Yield each result with the name of its solution: as `NAME=` says, a batch, or a folder of folders."""
    name, path = result_files.named(text)
    given = name if text.startswith(f"{name}=") else None
    batch = batch_folder.planned(path) if path.is_dir() else None
    if batch and any(one.solution for one in batch):
        unfinished = [one.source for one in batch if not one.path.is_file()]
        if unfinished:
            notes.append(f"{path}: {len(unfinished)} of {len(batch)} episodes are not finished; they are left out.")
        sources = [(one.solution, one.path) for one in batch if one.path.is_file()]
    elif path.is_dir() and not batch and not any(path.glob("*.json")):
        folders = sorted(one for one in path.iterdir() if one.is_dir() and not one.name.startswith("."))
        sources = [(folder.name, folder) for folder in folders] or [(None, path)]
    else:
        sources = [(None, path)]
    for solution, source in sources:
        for item in result_files.read([source]):
            if isinstance(item, Unreadable):
                raise item.error
            if not isinstance(item, ResultDocument):
                continue
            if not Path(item.source).is_file():
                raise BenchbotError(
                    f"{source} is an archive.",
                    "Simulators are told apart in files and folders.",
                    f"Unpack it: unzip {source} -d {source.with_suffix('')}",
                )
            yield given or solution or _command(item), item


def _command(result: ResultDocument) -> str:
    """Return what a result says of how its solution was started, without the interpreter."""
    words = [str(word) for word in _solution(result).get("command", [])]
    words = words[1:] if words and Path(words[0]).name.startswith("python") else words
    return " ".join([Path(words[0]).name, *words[1:]]) if words else ""


def _solution(result: ResultDocument) -> Mapping[str, Any]:
    return (result.document.get("provenance") or {}).get("solution") or {}


def _require_same_solution(name: str, group: Mapping[str, Sequence[ResultDocument]]) -> None:
    """Raise BenchbotError where the files or arguments of a solution differ between simulators."""
    told = {simulator: {_fingerprint(one) for one in results} - {None} for simulator, results in group.items()}
    said = [fingerprints for fingerprints in told.values() if fingerprints]
    if any(one != said[0] for one in said):
        raise BenchbotError(
            f"'{name}' is not the same solution in {' and '.join(sorted(group))}.",
            "Its files or arguments differ, so that a difference would not be that of simulators.",
            "Run the same in both, or compare one at a time: benchbot compare NAME=FOLDER … --across simulator",
        )


def _fingerprint(result: ResultDocument) -> tuple[Any, ...] | None:
    solution = _solution(result)
    files = tuple(sorted(solution.get("files", {}).values()))
    arguments = tuple(Path(str(word)).name for word in solution.get("command", [])[1:])
    return (files, arguments) if files else None


def _alike(a: ResultSet, b: ResultSet, solution: str, notes: list[str]) -> tuple[ResultSet, ResultSet]:
    """Return both sets with the results alone that the other has, too: of the same environment, settings and seed."""
    paired = pair(a.rows, b.rows)
    for one, rows in ((a, paired.only_a), (b, paired.only_b)):
        if rows:
            which = f"{solution}, " if solution else ""
            notes.append(f"{which}only in {one.name}, left out: {listed([label(row) for row in rows], '; ')}")
    kept = ([one.a for one in paired.pairs], [one.b for one in paired.pairs])
    return (_of_rows(a, kept[0]), _of_rows(b, kept[1]))


def _of_rows(results: ResultSet, rows: list[Document]) -> ResultSet:
    return ResultSet(results.name, {**results.document, "rows": rows, "coverage": {"missing": []}})


def _robot_notes(both: Mapping[str, tuple[ResultSet, ResultSet]], catalog: Catalog) -> list[str]:
    """Return in sentences what differs between robots beside their simulators, as far as they are installed."""
    pool = catalog.pool("robots")
    found = []
    for a, b in both.values():
        for one, other in ((one, other) for one in a.robots for other in b.robots):
            if one in pool and other in pool:
                keys = (pool[one].data.keys() | pool[other].data.keys()) - OF_THE_PLACE
                differ = sorted(key for key in keys if pool[one].data.get(key) != pool[other].data.get(key))
                if differ:
                    found.append(
                        f"{one} and {other} differ in {', '.join(differ)}: not all that differs is the simulator's."
                    )
    return list(dict.fromkeys(found))


def _by_scene(rows: Sequence[Document]) -> list[Document]:
    """Return for each scene its mean and largest difference, Kendall's τ, and the solution that differs the most."""
    from scipy.stats import kendalltau

    found = []
    for scene, group in groupby(sorted(rows, key=lambda row: str(row["scene"])), key=lambda row: row["scene"]):
        here = list(group)
        most = max(here, key=lambda row: abs(row["difference"]))
        several = len(here) >= scene_pairs.FEWEST_SOLUTIONS
        tau = float(kendalltau([row["a"] for row in here], [row["b"] for row in here]).statistic) if several else None
        found.append(
            {
                "scene": scene,
                "mean_difference": math.fsum(row["difference"] for row in here) / len(here),
                "largest_difference": most["difference"],
                "largest_of": most["solution"],
                "kendall_tau": None if tau is None or math.isnan(tau) else tau,
            }
        )
    return found


def _agreement(rows: Sequence[Document], over: Over) -> Document:
    """Return the interval of Kendall's τ-b of the solutions' means: a percentile bootstrap over places.

    The solutions are kept and places drawn, each with all its scenes (Efron and Tibshirani 1993, §13.3; Field and Welsh
    2007), as intervals of scores do; there is none of fewer than five places.
    """
    import numpy as np

    solutions = sorted({row["solution"] for row in rows})
    scenes = sorted(set.intersection(*({row["scene"] for row in rows if row["solution"] == one} for one in solutions)))
    units = sorted({over.unit(scene) for scene in scenes})
    if len(units) < intervals.FEWEST_CLUSTERS:
        needed = f"an interval needs {intervals.FEWEST_CLUSTERS} or more"
        return {"interval": None, "note": f"The scenes are of {intervals.counted(len(units), over)}; {needed}."}
    values = np.zeros((len(units), len(solutions), 2))
    for row in rows:
        if row["scene"] in scenes:
            values[units.index(over.unit(row["scene"])), solutions.index(row["solution"])] += row["a"], row["b"]
    sizes = np.array([sum(over.unit(scene) == unit for scene in scenes) for unit in units], float)
    drawn = np.random.default_rng(intervals.SEED).multinomial(
        len(units), np.full(len(units), 1 / len(units)), intervals.DRAWS
    )
    means = np.einsum("du,usb->dsb", drawn, values) / (drawn @ sizes)[:, None, None]
    taus = _taus(means)
    if np.ptp(taus) == 0.0:
        drawn_ones = intervals.counted(len(units), over)
        return {"interval": None, "note": f"Whatever is drawn of {drawn_ones}, tau is the same: no interval."}
    low, high = np.quantile(taus, [(1 - intervals.LEVEL) / 2, (1 + intervals.LEVEL) / 2])
    return {"interval": {"low": float(low), "high": float(high), "level": intervals.LEVEL}, "note": None}


def _taus(means: "NDArray[Any]") -> "NDArray[Any]":
    """Return Kendall's τ-b of each draw (D, solutions, 2); 0 where one side has the same mean for all."""
    import numpy as np

    first, second = np.triu_indices(means.shape[1], 1)
    signs = np.sign(np.round(means[:, first] - means[:, second], 12))
    untied = np.abs(signs).sum(axis=1)
    return np.asarray(signs.prod(axis=2).sum(axis=1) / np.sqrt(np.maximum(untied.prod(axis=1), 1)))


def _pictures(catalog: Catalog, both: Mapping[str, tuple[ResultSet, ResultSet]]) -> Iterator[Document]:
    """Yield for each pair of episodes with recorded pictures how much these differ, and where the most.

    The n-th of the one is held against the n-th of the other, in bytes of all colours, if they have the same size.
    """
    for solution, (a, b) in both.items():
        for one, other in zip(a.rows, b.rows, strict=True):
            steps = _steps(catalog, one, other)
            if steps:
                worst = sorted(steps, key=lambda step: -step["mean_absolute"])[:MOST_PICTURES]
                mean = math.fsum(step["mean_absolute"] for step in steps) / len(steps)
                about = {"solution": solution, "scene": one["environment"], "steps": len(steps)}
                yield {**about, "mean_absolute": mean, "unit": "of 255", "worst": worst}


def _steps(catalog: Catalog, a: Document, b: Document) -> list[Document]:
    import numpy as np

    pictures = [_recorded(catalog, row) for row in (a, b)]
    found = []
    for number, (one, other) in enumerate(zip(*pictures, strict=False)):
        if one is not None and other is not None and one[1].shape == other[1].shape:
            off = float(np.abs(one[1].astype(np.int16) - other[1]).mean())
            found.append({"step": number, "mean_absolute": off, "a": one[0], "b": other[0]})
    return found


def _recorded(catalog: Catalog, row: Document) -> "Iterator[tuple[str | None, NDArray[Any]] | None]":
    """Yield the pictures beside a result with their files: those of `frames`, or of a recording that can be read."""
    import numpy as np

    source = Path(str(row["source"]))
    frames = next(filter(None, map(numbered_frames, frame_folders(source)[:-1])), {})
    if frames:
        from PIL import Image

        for number in range(max(frames) + 1):
            yield (
                (str(frames[number]), np.asarray(Image.open(frames[number]).convert("RGB")))
                if number in frames
                else None
            )
        return
    recording = channel_differences.recording_of(catalog.plugins, str(source))
    if recording is not None:
        folder, read = recording
        for seen in read(folder):
            yield (None, seen["image_rgb"]) if "image_rgb" in seen else None
