"""A HyperQueue server, or a worker of one, in a process of its own: HyperQueue's Python package alone, no program `hq`.

    cluster.py server FOLDER
    cluster.py worker FOLDER-OF-THE-SERVER OWN-FOLDER

Prints `ready` when it is, and ends with its standard input.
"""

import os
import sys
from pathlib import Path

from hyperqueue import LocalCluster
from hyperqueue.cluster import WorkerConfig

# What tells clients and workers where the server of a folder is.
CURRENT = "hq-current"


def server(folder: str) -> LocalCluster:
    return LocalCluster(folder)


def worker(of: str, own: str) -> LocalCluster:
    # The package starts workers of its own server only. So this one, which has nothing to do, is replaced by the other.
    cluster = LocalCluster(own)
    link = Path(own, CURRENT)
    link.unlink()
    link.symlink_to(Path(of, CURRENT).resolve())
    cluster.start_worker(WorkerConfig(cores=1))
    return cluster


kind, *folders = sys.argv[1:]
cluster = {"server": server, "worker": worker}[kind](*folders)
print("ready", flush=True)
sys.stdin.read()
# Whatever still runs in this process ends with it.
os._exit(0)
