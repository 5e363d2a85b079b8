"""Draws how costs grow."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.rays.costs import Cost

PANELS = {
    "triangles": "triangles (320x180)",
    "pixels": "pixels (200k triangles)",
    "cameras of 64x64": "cameras of 64x64",
}


def draw(costs: Sequence[Cost], path: Path) -> None:
    """Processor milliseconds of all threads over the amount, a panel for each thing that grows; by `path`'s ending."""
    import matplotlib as mpl
    import matplotlib.pyplot as plt

    mpl.use("agg")
    mpl.rcParams["svg.hashsalt"] = "benchbot"  # equal figures, equal file
    figure, panels = plt.subplots(1, len(PANELS), figsize=(10, 3.2), sharey=True, layout="constrained")
    for panel, (grows, label) in zip(panels, PANELS.items(), strict=True):
        for kind, marker in (("depth+ids", "o"), ("picture", "s")):
            rows = [cost for cost in costs if cost.what == f"{kind} by {grows}"]
            panel.plot([row.amount for row in rows], [1e3 * row.processor_s for row in rows], marker=marker, label=kind)
        panel.set(xscale="log", yscale="log", xlabel=label)
        panel.xaxis.set_minor_formatter("")
        panel.grid(visible=True, which="both", linewidth=0.3)
    panels[0].set_ylabel("CPU ms, all threads")
    panels[0].legend()
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)
    plt.close(figure)
