#!/bin/sh
# Converts files in parts, as a Slurm array. The folder of the output must be on a disk that all
# nodes share. The plan is made first, here; then the jobs are submitted.
#
#     sh slurm.sh scan.splk 64 tiles/*.laz
#
# After a failure, give the same arguments again: finished parts are kept.
set -eu
out=$1 parts=$2
shift 2
PLAN=$out.parts/plan.json OUT=$out
export PLAN OUT
splatkit convert "$@" --plan "$out.parts" --parts "$parts" --memory "${MEMORY:-4GiB}" --overwrite
array=$(sbatch --parsable --job-name=splk-part --array="0-$((parts - 1))" \
    --mem="${NODE_MEMORY:-8G}" \
    --wrap 'splatkit convert --part "$PLAN" --index "$SLURM_ARRAY_TASK_ID"')
sbatch --job-name=splk-join --dependency="afterok:$array" --mem="${NODE_MEMORY:-8G}" \
    --wrap 'splatkit convert --join "$PLAN" -o "$OUT" --overwrite'
