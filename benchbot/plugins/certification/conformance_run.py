"""The conformance kit in a process of its own, since a simulator that crashes ends the process that it is in.

Its arguments are a simulator, a robot and an environment; its last line on stdout is the findings as JSON.
"""

import json
import sys

from benchbot.plugins.authoring.conformance.platforms import check_simulator

if __name__ == "__main__":
    found = check_simulator(*sys.argv[1:4])
    sys.stdout.flush()
    fields = ({"level": one.level.value, "subject": one.subject, "detail": one.detail, "fix": one.fix} for one in found)
    print(f"\n{json.dumps(list(fields))}")
