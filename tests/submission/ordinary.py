"""Commands as an ordinary user: what runs as root in CI has to work for people, too."""

import os
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchbot.plugins.sandbox.control_group import ENTER, control_group
from benchbot.submission.modes import ProcessLimits

SPARE_USER = 54321
NEEDED = (Path(sys.executable).resolve().parents[1], Path(__file__).resolve().parents[2])
"""The files that the command needs: Python, and the checkout with its packages."""

# Those may be in folders that are root's alone; in a mount namespace of its own, such a folder holds them only.
SCRIPT = """\
set -e
user=$1 stash=$2 closed=$3 needed=$4; shift 4
IFS=:
for path in $needed; do mkdir -p "$stash$path"; mount --bind "$path" "$stash$path"; done
for path in $closed; do mount -t tmpfs -o mode=755 none "$path"; done
for path in $needed; do mkdir -p "$path"; mount --bind "$stash$path" "$path"; umount -l "$stash$path"; done
exec setpriv --reuid="$user" --regid="$user" --clear-groups -- "$@"
"""


def ordinarily(command: list[str], folder: Path) -> list[str]:
    """Return the command that runs `command` as a user without any rights; `folder`, the test's, is theirs then.

    It must be one that others can reach: pytest's own are not.
    """
    if os.geteuid() != 0:
        return command
    for path in (folder, *folder.rglob("*")):
        os.chown(path, SPARE_USER, SPARE_USER, follow_symlinks=False)
    hidden = {path: closed for path in NEEDED if (closed := _closed(path)) is not None}
    if hidden:
        listed = [":".join(map(str, dict.fromkeys(paths))) for paths in (hidden.values(), hidden)]
        bare = ["unshare", "--mount", "sh", "-c", SCRIPT, "sh"]
        return [*bare, str(SPARE_USER), str(folder / "stash"), *listed, *command]
    return ["setpriv", f"--reuid={SPARE_USER}", f"--regid={SPARE_USER}", "--clear-groups", "--", *command]


@contextmanager
def delegated() -> Iterator[list[str]]:
    """Yield the words before a command of that user that let it make control groups, as systemd lets services do."""
    with control_group(ProcessLimits()) as group:
        assert group is not None, "it takes root to give away a control group"
        folders = list(dict.fromkeys(group.folders.values()))
        for folder in folders:
            controlled = folder / "cgroup.subtree_control"
            if controlled.exists():
                controlled.write_text("+memory +pids")
            inner = folder / "inner"
            inner.mkdir()
            for path in (folder, *folder.iterdir(), *inner.iterdir()):
                os.chown(path, SPARE_USER, SPARE_USER)
        entered = [str(folder / "inner" / "cgroup.procs") for folder in folders]
        yield ["/bin/sh", "-c", ENTER, "sh", *entered, "--"]
        for folder in folders:
            (folder / "inner").rmdir()


def _closed(path: Path) -> Path | None:
    """Return the outermost folder around a path that others cannot enter."""
    around = [folder for folder in path.parents if not folder.stat().st_mode & stat.S_IXOTH]
    return around[-1] if around else None
