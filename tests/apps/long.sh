#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Ten minutes of data, the demo's motion to and fro: every frame answered, whole files, still on the markers at the end.
#   long.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
arm=$2/models/arm19
. "$(dirname "$0")/../support/script.sh"

# lengthen HEAD_LINES FIRST_COLUMN_OF_VALUES < FILE: 60 001 rows at 100 Hz
lengthen() {
    awk -v head="$1" -v from="$2" 'NR <= head { sub(/nRows=301/, "nRows=60001"); gsub(/\t301/, "\t60001"); print; next }
        { split($0, cells, "\t"); n = length(cells); row = ""; for (i = from; i <= n; i++) row = row "\t" cells[i]; rows[count++] = row }
        END { period = 2 * (count - 1)
            for (k = 0; k <= 60000; k++) {
                at = k % period; at = at < count ? at : period - at
                print (from == 3 ? (k + 1) "\t" : "") k / 100 rows[at] } }'
}
lengthen 6 3 < "$arm/demo_markers.trc" > long.trc
lengthen 7 2 < "$arm/demo_emg.sto" > long.sto
cat > long.yaml << END_OF_CONFIG
model: {file: $arm/arm19.osim}
muscle: {curves: paper2021, passive_ramp: 0.02}
formulation: activation
data: {markers: long.trc, emg: long.sto, emg_delay: 0}
horizon: {window: 7, ratio: 3}
integrator: {tolerance: 0, stages: 2, max_step: 0.03, activation_step: 3.4}
costs: [mhe.cost.emg-markers-high]
solver: {plugin: mhe.solver.rti, preset: balanced}
output: {picture: false}
END_OF_CONFIG
"$run" long.yaml --out result --quiet > out.txt 2> err.txt || fail "exit status $?: $(cat err.txt)"
for file in estimates forces marker_residuals quality; do
    rows=$(sed '1,/endheader/d' result/$file.sto | tail -n +2 | wc -l)
    [ "$rows" -eq 19994 ] || fail "$rows rows in $file.sto"
    grep -qi 'nan' result/$file.sto && fail "NaN in $file.sto"
done
# time, status, iterations, KKT residual, ms, marker RMS: of the last minute
sed '1,/endheader/d' result/quality.sto | awk 'NR > 1 && $1 > 540 { n++; bad += $2 == 3; far = $6 > far ? $6 : far }
    END { print n " estimates, " bad " predicted, markers at most " 1e3 * far " mm"; exit !(n > 1990 && bad == 0 && far < 0.002) }' ||
    fail "the last minute"

finish "ten minutes"
