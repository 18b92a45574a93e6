"""Many traces on many machines: the same `eixo diagnose` or `identify` command under Dask distributed.

    .venv/bin/python scripts/dask_fleet.py [--scheduler tcp://host:8786 | --workers 2] -- \\
        diagnose machines/ --output out --summary out/summary.parquet

eixo lists the traces; every Dask task runs the command for a few of them (`--part TRACE`), which keeps their results in the
output folder; at the end the command itself runs here, finds all results kept, and writes summary and index. They are those of
a run on one machine, to the byte. Without --scheduler a cluster of processes is started on this machine.

The folders of the traces and of the output must be the same paths on every worker (a shared file system), and eixo the same
program there (--eixo PATH). A worker that is lost loses nothing: its traces are done by another one, or at the end.
Needs dask and distributed (scripts/requirements.txt).
"""

import argparse
import os
import shutil
import subprocess
import sys


def run_part(eixo, arguments, traces, folder):
    """On a worker: the command for these traces only. Its exit code; -1 where it could not be started."""
    part = [item for trace in traces for item in ("--part", trace)]
    try:
        return subprocess.run(
            [eixo, *arguments, *part], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, check=False
        ).returncode
    except OSError:
        return -1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scheduler", help="address of a running Dask scheduler")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="without --scheduler: processes to start here")
    parser.add_argument("--eixo", default=shutil.which("eixo") or "eixo", help="the program, as the workers find it")
    parser.add_argument("--batch", type=int, default=4, help="traces a task")
    parser.add_argument("arguments", nargs="+", help="the eixo command with --output, behind --")
    options = parser.parse_args()
    command = [options.eixo, *options.arguments]

    # What cannot be run is said by eixo itself, in its own words.
    listed = subprocess.run([*command, "--list"], stdout=subprocess.PIPE, text=True, check=False)
    if listed.returncode != 0:
        return listed.returncode
    traces = listed.stdout.splitlines()
    # The workers are the cores here: one trace at a time each, unless the command says otherwise.
    arguments = options.arguments if "--jobs" in options.arguments else [*options.arguments, "--jobs", "1"]

    from dask.distributed import Client, LocalCluster, as_completed

    cluster = None
    if not options.scheduler:
        cluster = LocalCluster(
            n_workers=options.workers, threads_per_worker=1, processes=True, dashboard_address=None
        )
    with Client(options.scheduler or cluster) as client:
        workers = len(client.scheduler_info(n_workers=-1)["workers"])
        batches = [traces[k : k + options.batch] for k in range(0, len(traces), options.batch)]
        futures = [client.submit(run_part, options.eixo, arguments, b, os.getcwd(), pure=False) for b in batches]
        for done, future in enumerate(as_completed(futures), 1):
            # What a task could not do, the run at the end does again and says why.
            if future.status != "finished" or future.result() not in (0, 1, 2):
                print(f"task {done} of {len(batches)} was not done; its traces are done at the end", file=sys.stderr)
        print(f"{len(traces)} traces in {len(batches)} tasks on {workers} workers", file=sys.stderr)
    if cluster:
        cluster.close()
    return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
