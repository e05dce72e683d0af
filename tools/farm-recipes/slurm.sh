#!/usr/bin/env bash
# A list of models as a Slurm array: each task builds one part of the list.
#
#     sbatch --array=0-63 tools/farm-recipes/slurm.sh LIST.jsonl DIR [OPTIONS OF silmap build]
#     tools/farm --collect LIST.jsonl -o DIR          # when the array has ended: table and page
#
# LIST.jsonl and DIR lie where every node sees them; `silmap` is on PATH, or SILMAP names it. A task whose models ran out of
# resources, or whose time was over, is queued again, twice at most; what is done is kept. Exit codes as those of
# `silmap build --manifest`.
#SBATCH --job-name=silmap
#SBATCH --cpus-per-task=1
#SBATCH --mem=2G
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --signal=B:TERM@120
#SBATCH --output=silmap-%A_%a.txt
set -uo pipefail

if [ $# -lt 2 ]; then
    echo "usage: sbatch --array=0-63 $0 LIST.jsonl DIR [OPTIONS OF silmap build]" >&2
    exit 2
fi
list=$1 folder=$2
shift 2
: "${SLURM_ARRAY_TASK_ID:?this is for sbatch --array}"

# The tasks of an array need not be counted from 0, nor by ones.
part=$(((SLURM_ARRAY_TASK_ID - ${SLURM_ARRAY_TASK_MIN:-0}) / ${SLURM_ARRAY_TASK_STEP:-1}))
tried=${SLURM_RESTART_COUNT:-0}
mkdir -p "$folder/lines" || exit 4

# The batch script gets Slurm's signal and passes it on, so that the model under way leaves nothing half-written.
"${SILMAP:-silmap}" build --manifest "$list" --out-dir "$folder/assets" \
    --shard "$part/${SLURM_ARRAY_TASK_COUNT:?}" --resume --threads "${SLURM_CPUS_PER_TASK:-1}" "$@" \
    >"$folder/lines/$tried-$part.jsonl" &
child=$!
trap 'kill -TERM "$child" 2>/dev/null' TERM INT
wait "$child"
code=$?
while kill -0 "$child" 2>/dev/null; do
    # A signal ends the first wait before the program has ended.
    wait "$child"
    code=$?
done

case $code in
    4 | 130)
        if [ "$tried" -lt 2 ]; then
            scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
        fi
        ;;
esac
exit "$code"
