#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-bench on the demo: the table, bench.json and the picture are there and whole; bad arguments say why. No time is judged.
#   bench.sh BIN_DIR SOURCE_DIR
set -u
bench=$1/mhe-bench
demo=$2/models/arm19/demo.yaml
. "$(dirname "$0")/../support/script.sh"

# has FILE 'TEXT'...
has() {
    file=$1
    shift
    for text in "$@"; do
        grep -qF -- "$text" "$file" || fail "'$text' is not in $file"
    done
}

"$bench" "$demo" --quick --repeats 1 --vary formulation=excitation,activation --vary horizon.window=2,3 --out result \
    > table.txt 2> err.txt || fail "exit status $?: $(cat err.txt)"
grep -v 'no picture: gnuplot cannot be started' err.txt | grep . && fail "messages"
has table.txt p50 p95 p99 max 'x med' 'prepare p50' 'feedback p50' p99.9 'evaluate p50' 'rest p50' 'skeleton kinematics' 'system acceleration, derivatives' 'activation rates' \
    'shooting interval with A and B' 'stage cost' 'linearisation of the window' \
    'formulation=excitation horizon.window=2' 'formulation=activation horizon.window=3'
json=result/bench.json
has $json '"kinematics"' '"acceleration"' '"acceleration_derivatives"' '"activation_rate"' '"interval"' \
    '"interval_derivatives"' '"interval_again"' '"stage_cost"' '"window_linearisation"' '"calls_per_sample"' '"ratio_to_first"' \
    '"rate_hz"' '"frame_ms"' '"first_frame_ms"' '"p50"' '"p95"' '"p99"' '"converged"' '"rmse"' '"force_n"'
# 9 layers of two formulations, of which one has no activation dynamics; 4 variants.
[ "$(grep -c '"calls_per_sample"' $json)" -eq 17 ] || fail "$(grep -c '"calls_per_sample"' $json) layers"
[ "$(grep -c '"frame_ms"' $json)" -eq 4 ] || fail "$(grep -c '"frame_ms"' $json) runs"
grep -q null $json && fail "a value is missing"
if command -v python3 > /dev/null; then
    python3 - $json << 'END' || fail "bench.json"
import json, sys
bench = json.load(open(sys.argv[1]))
assert [run["n_window"] for run in bench["runs"]] == [2, 3, 2, 3]
assert [run["formulation"] for run in bench["runs"]] == 2 * ["excitation"] + 2 * ["activation"]
first = bench["runs"][0]["ratio_to_first"]
assert first["min"] == first["median"] == first["max"] == 1
for item in bench["layers"] + bench["runs"]:
    t = item["us"] if "us" in item else item["frame_ms"]
    assert 0 < t["p50"] <= t["p95"] <= t["p99"] <= t["p99.9"] <= t["max"]
    r = item["ratio_to_first"]
    assert 0 < r["min"] <= r["median"] <= r["max"]
for run in bench["runs"]: # the parts of a frame
    frame, feedback = run["frame_ms"], run["feedback_ms"]
    assert 0 < run["prepare_ms"]["p50"] < frame["p50"]
    assert 0 < feedback["p50"] <= feedback["p99.9"] <= feedback["max"] < frame["max"]
    assert 0 < run["feedback_evaluation_ms"]["p50"] < feedback["p50"]
    assert 0 < run["feedback_rest_ms"]["p50"] < feedback["p50"]
    # Of one run each frame is its own median.
    assert {key: feedback[key] for key in feedback["by_frame"]} == feedback["by_frame"]
END
fi
grep -q 'feedback by frame' table.txt && fail "one run has no medians of frames"
[ ! -e result/frames.csv ] || fail "frames.csv was not asked for"

# Each frame by its median over three runs: as what is written of every frame says.
"$bench" "$demo" --quick --repeats 3 --no-layers --frames --vary horizon.window=2,3 --out frames > table.txt 2> err.txt || fail "--frames: $(cat err.txt)"
has table.txt 'feedback by frame, ms' 'one run, x' 'p99.9, x'
grep -q 'us a call' table.txt && fail "no layers were asked for"
grep -q '"us"' frames/bench.json && fail "no layers were asked for"
# A heading; of each variant three runs of 25 estimates but the first, which are numbered from 2.
[ "$(wc -l < frames/frames.csv)" -eq 145 ] || fail "$(wc -l < frames/frames.csv) lines of frames"
if command -v python3 > /dev/null; then
    python3 - frames << 'END' || fail "frames.csv"
import csv, json, math, statistics, sys
bench = json.load(open(sys.argv[1] + "/bench.json"))
rows = list(csv.DictReader(open(sys.argv[1] + "/frames.csv")))
near = lambda a, b: math.isclose(a, b, abs_tol=2e-6)
for i, run in enumerate(bench["runs"]):
    of = [[row for row in rows if (row["variant"], row["run"]) == (str(i + 1), str(r))] for r in (1, 2, 3)]
    assert all([int(row["estimate"]) for row in one] == list(range(2, 26)) for one in of)
    for key in "prepare_ms", "feedback_ms", "feedback_evaluation_ms":
        times = [[float(row[key]) for row in one] for one in of]
        own = sorted(statistics.median(frame) for frame in zip(*times))
        by_frame, every = run[key]["by_frame"], sorted(sum(times, []))
        assert near(by_frame["p50"], own[11]) and near(by_frame["p99.9"], own[-1]) and near(by_frame["max"], own[-1])
        assert near(run[key]["p50"], every[35]) and near(run[key]["max"], every[-1])
        assert by_frame["max"] <= run[key]["max"] and every[0] <= own[0]
        tails = [max(one) / sorted(one)[11] for one in times]
        assert math.isclose(run[key]["p99.9_over_p50_of_a_run"], statistics.median(tails), rel_tol=1e-2)
END
fi
[ -s result/rate.gp ] || fail "no rate.gp"
if command -v gnuplot > /dev/null; then
    has result/rate.svg '</svg>' 'formulation=excitation' 'formulation=activation' 'biofeedback, 13.3 Hz' 'window (intervals)'
fi
find . -name '.*' -type f | grep . && fail "temporary files are left"

# The windows that are taken where none are asked for.
for arguments in '' --quick; do
    # shellcheck disable=SC2086 # none or one word
    "$bench" "$demo" $arguments --repeats 1 --set horizon.ratio=12 --set solver.max_iterations=1 --out windows > windows.txt 2> err.txt ||
        fail "without --vary: $(cat err.txt)"
    has windows.txt 'horizon.window=3' 'horizon.window=7' 'horizon.window=15'
done

# Models that are made up: every size estimates what it was simulated with.
"$bench" --scale --quick --repeats 1 --out scale > scale.txt 2> err.txt || fail "--scale: $(cat err.txt)"
has scale.txt 'exponent of the time in muscles' 'in coordinates, 7 to 14 at 80 muscles'
[ "$(awk '$1 ~ /^[0-9]+$/ && $9 < 1 && $4 > 0' scale.txt | wc -l)" -eq 3 ] || fail "--scale: $(cat scale.txt)"

# refused 'TEXT IN THE MESSAGE' ARGUMENTS...: exit status 2, one line, nothing written
refused() {
    text=$1
    shift
    rm -rf other
    "$bench" --out other "$@" > out.txt 2> err.txt
    status=$?
    [ $status -eq 2 ] || fail "$*: exit status $status"
    [ "$(wc -l < err.txt)" -eq 1 ] || fail "$*: $(cat err.txt)"
    [ ! -e other ] && [ ! -s out.txt ] || fail "$*: something was written"
    has err.txt "$text"
}

refused 'config file'
refused 'nowhere.yaml' nowhere.yaml
refused "did you mean '--quick'" "$demo" --quik
refused 'one config file' "$demo" "$demo"
refused '--repeats' "$demo" --repeats 0
refused '--repeats' "$demo" --repeats 2x
refused 'needs a value' "$demo" --vary
refused 'wanted is' "$demo" --vary horizon.window
refused 'a value is empty' "$demo" --vary horizon.window=3,,4
refused 'more than 64' "$demo" --vary horizon.window=1,2,3,4,5,6,7,8,9 --vary horizon.ratio=1,2,3,4,5,6,7,8,9
refused "did you mean 'window'" "$demo" --vary horizon.windw=1,2
refused "'window' must lie" "$demo" --vary horizon.window=3,0
refused 'with a config file' --scale --frames
refused 'with a config file' --scale --vary horizon.window=3,7
refused 'too few' "$demo" --quick --vary horizon.window=3,900
"$bench" --help | grep -q -- '--vary' || fail "--help"
"$bench" --version | grep -q '^mhe-bench [0-9]' || fail "--version"

finish "bench"
