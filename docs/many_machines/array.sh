#!/bin/bash
#SBATCH --job-name=slide-fmu
#SBATCH --array=1-8
#SBATCH --cpus-per-task=4
#SBATCH --mem-per-cpu=2G
#SBATCH --time=04:00:00
# Usage: sbatch array.sh RECIPE RUNS, with a folder RUNS on a disk that all machines share.
# Each task of the array makes what the others have left.
set -euo pipefail
export OMP_NUM_THREADS=1
slide-fmu generate "$1" --runs "$2" --workers "$SLURM_CPUS_PER_TASK"
