#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# A study, and a session's trials, on a real Slurm: controller, node and authentication of its own, started here with a folder and ports of their
# own; a node that dies with its task, whose task is queued again; the results are those of a run without Slurm.
#   slurm.sh PATH/mhe-study SOURCE_DIR
set -u
study=$1 source=$2
export PATH="$PATH:/usr/sbin:/sbin"
skip() {
    echo "skipped: $*"
    exit 77
}
[ "$(id -u)" -eq 0 ] || skip "Slurm's node has to be started by root"
for program in munged slurmctld slurmd sbatch squeue scontrol; do
    command -v $program > /dev/null || skip "$program is not installed (slurm-wlm)"
done
. "$source/tests/support/script.sh"
chmod 755 "$work"
pids=()
# Ends what was started here, and nothing else.
end_all() {
    for pid in "${pids[@]}"; do
        kill "$pid" 2> /dev/null
    done
    wait
    rm -rf "$work"
}
trap end_all EXIT

# ---- a cluster of this machine ----

port=$((20000 + $$ % 20000))
host=$(hostname -s)
mkdir -m 755 munge state spool
dd if=/dev/urandom of=munge/key bs=1024 count=1 2> /dev/null
chmod 400 munge/key
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" \
    --seed-file="$work/munge/seed" --log-file="$work/munge/log" > munge/out 2>&1 &
pids+=($!)
cat > slurm.conf << END_OF_CONF
ClusterName=study
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
MailProg=/bin/true
ReturnToService=2
MinJobAge=600
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=500 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
END_OF_CONF
export SLURM_CONF="$work/slurm.conf"

# until_true SECONDS COMMAND...
until_true() {
    for _ in $(seq $((5 * $1))); do
        "${@:2}" > /dev/null 2>&1 && return 0
        sleep 0.2
    done
    return 1
}
start_node() {
    slurmd -D > slurmd.out 2>&1 &
    node=$!
    pids+=("$node")
}
node_is_idle() { sinfo -h -o %T | grep -Eq '^(idle|mixed|allocated)$'; }
until_true 20 test -S munge/socket || skip "munged does not start: $(cat munge/out munge/log 2> /dev/null | tail -n 1)"
slurmctld -D > slurmctld.out 2>&1 &
pids+=($!)
until_true 30 scontrol ping || skip "slurmctld does not start: $(tail -n 1 slurmctld.log)"
start_node
until_true 30 node_is_idle || skip "slurmd does not start: $(tail -n 1 slurmd.log)"

# ---- the study ----

# Trials from the third of each condition on wait for a gate, so that there are some to be done when the node dies.
cat > trial.sh << END_OF_PROGRAM
#!/bin/sh
while [ "\$4" -gt 1 ] && [ ! -e "$work/gate" ]; do sleep 0.1; done
echo converged 1
echo force_n "\$6"
END_OF_PROGRAM
chmod +x trial.sh
cat > small.yaml << END_OF_STUDY
config: $source/models/arm19/studies/estimate.yaml
program: trial.sh
trials: 4
factors: {amount: {values: [little, much]}}
grids: [{amount: [little, much]}]
END_OF_STUDY
touch gate
"$study" run small.yaml --trust --out calm --quiet > out.txt 2> err.txt || fail "without Slurm: $(cat err.txt)"
rm gate
"$study" submit small.yaml --trust --engine slurmm 2> err.txt && fail "an engine that is not known"
grep -q "did you mean 'slurm'" err.txt || fail "an engine that is not known: $(cat err.txt)"
"$study" submit small.yaml --trust --engine slurm --out cluster --tasks 2 --option --time=20 > out.txt 2> err.txt ||
    fail "submit: $(cat err.txt)"
cat out.txt
job=$(sed -n 's/^job \([0-9]*\):.*/\1/p' out.txt)
[ -n "$job" ] || fail "no job: $(cat out.txt)"

rows() { [ "$(cat cluster/rows/*.rows 2> /dev/null | wc -l)" -ge "$1" ]; }
ended() { [ -z "$(squeue -h -j "$job")" ] || ! squeue -h -j "$job" -o %T | grep -Eqv '^(COMPLETED|FAILED|CANCELLED|NODE_FAIL)$'; }

# The node dies: slurmd, what it started, and the tasks, all at once.
until_true 120 rows 2 || fail "no trial was run: $(cat cluster/slurm/*.log slurmd.log | tail -n 3)"
victims=()
for task in $(scontrol listpids 2> /dev/null | awk 'NR > 1 && $1 > 0 { print $1 }'); do
    # Tasks are children of their slurmstepd, which belongs to nobody else.
    step=$(ps -o ppid= -p "$task" | tr -d ' ')
    [ -n "$step" ] && ps -o comm= -p "$step" | grep -q slurmstepd && victims+=("$step")
    victims+=("$task")
done
[ ${#victims[@]} -ge 2 ] || fail "no task to kill: $(scontrol listpids)"
kill -9 "$node" "${victims[@]}"
{ wait "$node"; } 2> /dev/null
killed=$(cat cluster/rows/*.rows | wc -l)
[ -e cluster/results.csv ] && fail "it was over before it was killed"
touch gate
scontrol update nodename="$host" state=down reason=test || fail "the node cannot be set down"
requeued() { squeue -h -j "$job" -o '%T' | grep -q PENDING; }
until_true 30 requeued || fail "the tasks are not queued again: $(squeue -j "$job")"
start_node
sleep 1
scontrol update nodename="$host" state=resume 2> /dev/null # where it is not back by itself
until_true 30 node_is_idle || fail "the node does not come back: $(tail -n 2 slurmd.log)"
for task in 0 1; do # a requeued task waits two minutes for its turn unless told
    scontrol update jobid="${job}_$task" starttime=now 2> /dev/null
done
until_true 240 ended || fail "the job does not end: $(squeue -j "$job")"
echo "$killed rows when the node died, $(cat cluster/rows/*.rows | wc -l) at the end"
scontrol show job "$job" | grep -q 'Restarts=[1-9]' || fail "no task was started again: $(scontrol show job "$job" | grep Restarts)"
until_true 20 test -e cluster/results.csv || fail "no tables: $(cat cluster/slurm/*.log)"
cmp calm/results.csv cluster/results.csv || fail "the results are not those of a run without Slurm"
grep -q 'trials are there already' cluster/slurm/*.log || fail "a requeued task began anew: $(cat cluster/slurm/*.log)"
cp cluster/results.csv before.csv
"$study" merge cluster > out.txt 2> err.txt || fail "merge: $(cat err.txt)"
cmp before.csv cluster/results.csv || fail "merging changes the results"

# ---- a session's trials: mhe-run --batch ----

run=$(dirname "$study")/mhe-run demo=$source/models/arm19/demo.yaml
printf 'name,horizon.window\nfive,5\nsix,6\nseven,7\n' > trials.csv
keys=(--set output.picture=false --set solver.plugin=mhe.solver.rti)
"$run" "$demo" --batch trials.csv --out here --quiet "${keys[@]}" > out.txt 2>&1 || fail "batch without Slurm: $(cat out.txt)"
"$run" "$demo" --batch trials.csv --out there "${keys[@]}" --engine slurm --tasks 2 --option --time=20 > out.txt 2>&1 ||
    fail "batch: $(cat out.txt)"
job=$(sed -n 's/.*job \([0-9]*\):.*/\1/p' out.txt)
[ -n "$job" ] || fail "no job: $(cat out.txt)"
until_true 240 ended || fail "the job does not end: $(squeue -j "$job")"
all_there() { [ "$(grep -c ',yes,' there/batch.csv)" -eq 3 ] && [ -s there/batch.html ]; }
until_true 20 all_there || fail "no table of three: $(cat there/batch.csv there/slurm/*.log)"
for trial in five six seven; do
    cmp "here/$trial/forces.sto" "there/$trial/forces.sto" || fail "the results are not those of a run without Slurm"
done

finish "slurm"
