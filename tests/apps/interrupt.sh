#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# SIGTERM ends mhe-run whatever it is busy with, and leaves whole files or none. No time is judged: a run that does not
# end is ended by `timeout`, whose status tells.
#   interrupt.sh PATH/mhe-run FOLDER_OF_HANGING_COST SOURCE_DIR
set -u
run=$1
hanging=$2
demo=$3/models/arm19/demo.yaml
. "$(dirname "$0")/../support/script.sh"

# begun FOLDER: its results have temporary names
begun() { ls "$1"/.quality.sto.*.tmp > /dev/null 2>&1; }

# interrupted FOLDER [arguments]: SIGTERM once the results are begun -> status, err.txt
interrupted() {
    folder=$1
    shift
    timeout -s KILL 60 "$run" "$demo" --quiet --out "$folder" --set output.picture=false "$@" > out.txt 2> err.txt &
    pid=$!
    until begun "$folder" || ! kill -0 $pid 2> /dev/null; do sleep 0.1; done
    sleep 1
    kill -TERM $pid # timeout hands it on
    wait $pid
    status=$?
}

# ended FOLDER 'TEXT' FILES: what there is afterwards
ended() {
    [ "$status" -eq 1 ] || fail "$1: exit status $status: $(cat err.txt)"
    grep -qF -- "$2" err.txt || fail "$1: '$2' is not in: $(cat err.txt)"
    [ -z "$(find "$1" -name '*.tmp')" ] || fail "$1: temporary files are left"
    [ "$(find "$1" -type f | wc -l)" -ge "$3" ] || fail "$1: files are missing"
    [ "$3" -gt 0 ] || [ -z "$(find "$1" -type f)" ] || fail "$1: there are files: $(ls "$1")"
}

# Between two frames: what was estimated until then is there, complete.
interrupted live --realtime
ended live 'interrupted after' 9
rows=$(sed -n 's/^nRows=//p' live/estimates.sto)
[ "$(sed '1,/endheader/d' live/estimates.sto | tail -n +2 | wc -l)" -eq "$rows" ] || fail "estimates.sto is not whole"

# The same signal twice in one go, as programs that watch over others send it, is one signal.
"$run" "$demo" --quiet --out twice --realtime --set output.picture=false > out.txt 2> err.txt &
pid=$!
until begun twice || ! kill -0 $pid 2> /dev/null; do sleep 0.1; done
sleep 1
kill -TERM $pid
kill -TERM $pid
wait $pid
status=$?
ended twice 'interrupted after' 9

# In a solve that takes long: 7 intervals of 30 000 steps, iteration by iteration, without the limit of work.
interrupted slow --set integrator.max_step=1e-6 --set realtime.deadline_ms=600000
ended slow 'interrupted' 0

# In a plugin that never comes back.
MHE_PLUGIN_PATH=$MHE_PLUGIN_PATH:$hanging
interrupted hanging --set 'costs=[test.cost.hanging]'
ended hanging 'nothing is written' 0

finish "SIGTERM"
