"""Let workers that SLURM starts make the trajectories of a recipe.

Usage: python slurm.py RECIPE RUNS JOBS, on a login node, with a folder RUNS on a disk that all
machines share. SLURM starts the jobs one by one, as it has room; the first ones begin to work.
"""

import subprocess
import sys
from shlex import quote

from dask_jobqueue import SLURMCluster

CORES = 2

if __name__ == "__main__":
    recipe, runs, jobs = sys.argv[1:]
    with SLURMCluster(
        cores=CORES,
        processes=CORES,  # one thread each: a simulation keeps a core busy
        memory=f"{2 * CORES}GB",
        walltime="04:00:00",
        python=quote(sys.executable),  # the job's script is one of the shell
        job_script_prologue=["export OMP_NUM_THREADS=1"],
    ) as cluster:
        cluster.scale(jobs=int(jobs))
        address = cluster.scheduler_address.replace("tcp://", "dask://")
        command = ["slide-fmu", "generate", recipe, "--runs", runs, "--executor", address]
        sys.exit(subprocess.run(command).returncode)
