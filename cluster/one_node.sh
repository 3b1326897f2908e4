#!/bin/bash
# A one-node Slurm, started, used and stopped: shows that a sweep's shards, one of them killed in the middle and requeued, merge
# to the bytes of one machine's table. As root, on Debian with `apt-get install slurm-wlm munge`.
#
#   cluster/one_node.sh PLAN.toml NEW_DIR [SHARDS]
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
plan=$(realpath "${1:?usage: cluster/one_node.sh PLAN.toml NEW_DIR [SHARDS]}")
out=${2:?usage: cluster/one_node.sh PLAN.toml NEW_DIR [SHARDS]}
shards=${3:-4}
TREADMARK=$(realpath "${TREADMARK:-$here/../target/release/treadmark}")
export TREADMARK
for program in munged slurmctld slurmd sbatch "$TREADMARK"; do
    command -v "$program" > /dev/null || { echo "error: $program is missing; apt-get install slurm-wlm munge, cargo build --release" >&2; exit 2; }
done
[ "$(id -u)" = 0 ] || { echo "error: a cluster of one's own takes root" >&2; exit 2; }
mkdir "$out"
out=$(realpath "$out")

# ── configure ──
# Everything of this cluster lies in its own folder; only munge's key and socket are the machine's.
slurm=$(mktemp -d /tmp/one-node-slurm.XXXXXX)
mkdir "$slurm/state" "$slurm/spool"
node=$(hostname -s)
cat > "$slurm/slurm.conf" << CONF
ClusterName=one-node
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=26817
SlurmdPort=26818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/spool
SlurmctldPidFile=$slurm/slurmctld.pid
SlurmdPidFile=$slurm/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$slurm/slurm.conf

# ── start ──
started=()
stop() {
    trap - EXIT
    for pid in "${started[@]}"; do kill "$pid" 2> /dev/null || true; done
    wait 2> /dev/null || true
    cp "$slurm"/*.log "$out"/ 2> /dev/null || true
    rm -rf "$slurm"
}
trap stop EXIT
if ! munge -n > /dev/null 2>&1; then
    mkdir -p /run/munge && chown munge: /run/munge && chmod 755 /run/munge
    runuser -u munge -- munged --foreground > "$slurm/munged.log" 2>&1 & started+=($!)
fi
for _ in $(seq 50); do munge -n > /dev/null 2>&1 && break; sleep 0.2; done
slurmctld -D > "$slurm/slurmctld.log" 2>&1 & started+=($!)
slurmd -D > "$slurm/slurmd.log" 2>&1 & started+=($!)
for _ in $(seq 100); do [ "$(sinfo -h -o %T 2> /dev/null)" = idle ] && break; sleep 0.3; done
sinfo
[ "$(sinfo -h -o %T)" = idle ] || { echo "error: the node does not come up" >&2; tail "$slurm"/*.log >&2; exit 1; }

# ── run, and kill one worker in the middle ──
cd "$out"
job=$(sbatch --parsable --array=0-$((shards - 1)) "$here/sweep.sbatch" "$plan" "$out/shards")
echo "job $job: $shards shards"
victim=0/$shards
journal="$out/shards/shard-0-of-$shards/journal.tsv"
# Half of its points, so that there is something to go on from and something to go on with.
for _ in $(seq 6000); do [ -f "$journal" ] && [ -n "$(sed -n 1p "$journal")" ] && break; sleep 0.1; done
all=$(sed -n '1s/.*"points":\([0-9]*\).*/\1/p' "$journal")
points=$(((all + shards - 1) / shards))
for _ in $(seq 6000); do [ "$(wc -l < "$journal")" -gt $((points / 2)) ] && break; sleep 0.1; done
worker=$(pgrep -f -- "treadmark sweep $plan --out $out/shards --shard $victim" | tail -1)
before=$(($(wc -l < "$journal") - 1))
kill -9 "$worker"
echo "worker $worker of shard $victim killed with $before of $points points done"
squeue
while [ -n "$(squeue -h -j "$job" 2> /dev/null)" ]; do
    # Slurm lets a requeued task wait for two minutes, in case that its node is sick; this one is not.
    squeue -h -j "$job" -t PD -o "%i %r" | while read -r task reason; do
        [ "$reason" != BeginTime ] || scontrol update "JobId=$task" StartTime=now
    done
    sleep 1
done
cat "$out"/sweep-"$job"_*.log
scontrol show job "$job" | grep -E "JobState|Restarts" || true

# ── the same bytes ──
"$TREADMARK" sweep --merge "$out/shards"
"$TREADMARK" sweep "$plan" --out "$out/one-machine" 2> /dev/null
grep -q "start 2" "$out"/sweep-"$job"_0.log || { echo "error: the killed task was not requeued" >&2; exit 1; }
cmp "$out/shards/sweep.parquet" "$out/one-machine/sweep.parquet"
echo "merged table and one machine's are the same $(wc -c < "$out/one-machine/sweep.parquet") bytes"
