"""The resources of the cluster's nodes, for the error about a request that no node can meet."""

from benchbot_executor_slurm.commands import ask

ADVICE = (
    "Ask for what one of its nodes has (--cpus, --gpus, --memory-gb, --time-limit, --executor-option partition=NAME)."
)


def offer() -> str:
    """Return the partitions and what their nodes have, as a sentence."""
    listed = ask("sinfo", "--noheader", "--format=%P (%D x %c cores, %m MB, GPUs: %G, at most %l)").said
    return f"It has: {'; '.join(listed.splitlines())}."


def partitions() -> list[str]:
    """Return the names of the partitions, sorted."""
    return sorted({name.rstrip("*") for name in ask("sinfo", "--noheader", "--format=%P").said.split()})
