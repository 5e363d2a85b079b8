"""Failures of pip and uv as errors with a title, the reason in the words of the program, and a fix."""

import re

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.subprocesses import ProcessResult

_MAX_LINES = 8
_MAX_CHARACTERS = 200
_CONFLICT = "The conflict is caused by"
_KNOWN: tuple[tuple[str, str, str], ...] = (
    (
        r"No space left on device|os error 28\b|Errno 28",
        "The disk is full.",
        "Free some disk space, then run the command again. Nothing was changed.",
    ),
    (
        r"Permission denied|Read-only file system|os error (13|30)\b|Errno (13|30)",
        "There is no permission to write.",
        "See that the environment is yours to write, or make one of your own: python3 -m venv FOLDER",
    ),
    (
        r"Hash mismatch|DO NOT MATCH THE HASHES|hash.{0,40}do(es)? not match",
        "What the index offers is not what was asked for: its hash is wrong.",
        "Do not install it: somebody may have replaced the file. If you know why it changed, ask for the new hash.",
    ),
    (
        r"require-hashes|Hash-checking|Hashes are required",
        "A hash is missing.",
        "Give one for everything that is installed: 'NAME==VERSION --hash=sha256:…', or leave out --require-hashes.",
    ),
    (
        (
            r"(?i)error sending request|connection (refused|reset)|NewConnectionError|connect error|dns error|"
            r"timed out|Name or service not known|Temporary failure in name resolution|Max retries exceeded|"
            r"Could not connect"
        ),
        "The package index cannot be reached.",
        "Check the network and the address, or install without: --no-index --find-links FOLDER",
    ),
    (
        r"(?i)401 |403 |unauthorized|forbidden|authentication",
        "The package index refuses access.",
        "Check the user name and password or token in the index's address, or its keyring or netrc entry.",
    ),
    (
        (
            r"(?i)invalid zip|bad zip|from zip file|BadZipFile|trailing contents|has an invalid wheel|"
            r"wheel.{0,80}is invalid|failed to extract|corrupt|Invalid wheel|not a valid wheel|RECORD|"
            r"failed to read metadata|EOCD|central directory|metadata.{0,30}(missing|invalid|not found)|"
            r"\.dist-info directory"
        ),
        "A wheel is damaged.",
        "Report it to who published it; if the download was broken off, try again.",
    ),
    (
        (
            r"not found in the package registry|from versions: none|not found in the provided package locations|"
            r"no files? found for|were not found"
        ),
        "There is no such distribution.",
        "See that the name and version are right: benchbot plugins search WORD",
    ),
    (
        r"no wheels? |no usable wheels|--only-binary|building from source is disabled|no-build",
        "There is no wheel for this machine, and building one would run its code.",
        "Ask its author for a wheel; if you trust it, allow building it: --trust",
    ),
    (
        r"No solution found|ResolutionImpossible|conflicting dependencies|No matching distribution|unsatisfiable",
        "There is no set of versions that fits together.",
        "Ask for other versions, or uninstall what is in the way: benchbot uninstall NAME",
    ),
)


def installer_error(installer: str, result: ProcessResult) -> BenchbotError:
    """Return the error of an installer that failed: the first known one whose pattern its output matches."""
    output = f"{result.err}\n{result.out}"
    for pattern, title, fix in _KNOWN:
        if re.search(pattern, output):
            return BenchbotError(title, _quoted(installer, output), fix)
    return BenchbotError(
        f"{installer} failed.",
        f"{installer} ended with exit status {result.code}. {_quoted(installer, output)}",
        "Try the other installer with --installer uv or --installer pip.",
    )


def _quoted(installer: str, output: str) -> str:
    """Return the last lines of an output, or the conflict in it, without those that only report progress."""
    lines = [re.sub(r"^(error|ERROR|  cause|WARNING): ?", "", line).strip() for line in output.splitlines()]
    relevant = [line for line in lines if line and not re.match(r"(Using |Resolved |Prepared |\[notice\])", line)]
    # What pip says after its list of conflicts is general advice, which is the end of its output.
    conflict = next((at for at, line in enumerate(relevant) if line.startswith(_CONFLICT)), None)
    kept = relevant[-_MAX_LINES:] if conflict is None else relevant[conflict : conflict + _MAX_LINES]
    last = [f"{line[:_MAX_CHARACTERS]}{'…' * (len(line) > _MAX_CHARACTERS)}" for line in kept]
    return "\n".join([f"{installer} says:", *last]) if last else f"{installer} gave no reason."
