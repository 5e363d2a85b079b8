"""Commands as an ordinary user: what runs as root in CI has to work for people, too."""

import os
import sys
from pathlib import Path

SPARE_USER = 54321

# The interpreter of these tests may be in a home that is root's alone: in a mount namespace of its own, it is not.
SCRIPT = """\
set -e
user=$1 home=$2 prefix=$3 stash=$4; shift 4
mkdir -p "$stash"
mount --bind "$prefix" "$stash"
mount -t tmpfs -o mode=755 none "$home"
mkdir -p "$prefix"
mount --bind "$stash" "$prefix"
umount -l "$stash"
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
    home, prefix, stash = Path("/root"), Path(sys.executable).resolve().parents[1], folder / "stash"
    if prefix.is_relative_to(home):
        bare = ["unshare", "--mount", "sh", "-c", SCRIPT, "sh"]
        return [*bare, str(SPARE_USER), str(home), str(prefix), str(stash), *command]
    return ["setpriv", f"--reuid={SPARE_USER}", f"--regid={SPARE_USER}", "--clear-groups", "--", *command]
