"""Runs the examples that it is told, one after another, and prints their exit codes: less to import for each."""

import json
import os
import runpy
import sys
import traceback
from pathlib import Path

import benchbot_api

here, codes = Path(__file__).parent, {}
print(f"the client: {benchbot_api.__file__}")
for name in sys.argv[1:] or os.environ["args"].split():  # noqa: SIM112 - as v2 calls it
    process = os.fork()
    if process == 0:
        code = 1
        try:
            runpy.run_path(str(here / f"{name}.py"), run_name="__main__")
            code = 0
        except SystemExit as error:
            code = error.code or 0
        except BaseException:  # noqa: BLE001 - it is the end of an example
            traceback.print_exc()
        sys.stdout.flush()
        os._exit(code)
    codes[name] = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
print("exit codes:", json.dumps(codes), flush=True)
