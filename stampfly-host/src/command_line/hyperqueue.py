"""Submits the tasks that standard input describes to HyperQueue's server, and waits for them.

The server is the one of HQ_SERVER_DIR, or of the home folder.
"""

import json
import os
import sys

from hyperqueue import Client, Job
from hyperqueue.output import StdioDef

job = json.load(sys.stdin)
client = Client(os.environ.get("HQ_SERVER_DIR"))
# A task that fails is no reason to stop the others: what is missing afterwards is flown by the next run.
submitted = Job(name=job["name"], max_fails=None)
for task in job["tasks"]:
    submitted.program(task["arguments"], stdout=None, stderr=StdioDef.remove_if_finished(task["stderr"]))
if not client.wait_for_jobs([client.submit(submitted)], raise_on_error=False):
    sys.exit("some tasks failed")
