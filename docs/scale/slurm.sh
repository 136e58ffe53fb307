#!/usr/bin/env bash
# One share of a data set a task of a Slurm array; the last job joins them.
#
#   make=$(sbatch --parsable --array=0-15 docs/scale/slurm.sh)
#   sbatch --dependency=afterok:$make docs/scale/slurm.sh merge
#
#SBATCH --job-name=wakes
#SBATCH --ntasks=1
#SBATCH --requeue
set -euo pipefail
program=${PROGRAM:-target/release/wake}
out=${OUT:-out/dataset}
if [ "${1:-}" = merge ]; then
  exec "$program" dataset --merge --out "$out"
fi
# A task that was killed continues where it stopped.
exec "$program" dataset --grid "${GRID:-ranges}" --count "${COUNT:-1000000}" --seed "${SEED:-7}" \
  --jobs "${SLURM_CPUS_ON_NODE:-1}" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" --out "$out"
