#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Files as labs have them: each is read for what it means, or refused with what is wrong and what helps. One motion of a
# hinge, flex(t) = 0.5 + 0.3 sin(1.6 pi t) rad, written in many ways; made here, and where the shared data are there
# (MHE_SHARED or ../shared) the files of data/cases too.
#   cases.sh PATH/mhe-run SOURCE_DIR
set -u
run=$(realpath "$1")
shared=${MHE_SHARED:-$2/../shared}/data/cases
. "$(dirname "$0")/../support/script.sh"
count=0

# truth DIR: largest error of the hinge's angle, rad; "none" where it has no estimate
truth() {
    awk 'BEGIN {pi = atan2(0, -1)} /^time/ {for (i = 2; i <= NF; i++) if ($i ~ /^q_/) c = i; next}
        c {e = $c - 0.5 - 0.3 * sin(1.6 * pi * $1); if (e < 0) e = -e; if (!(e <= m)) m = e; n++}
        END {if (n) print m; else print "none"}' "$1/estimates.sto" 2>/dev/null || echo none
}

# read NAME TOLERANCE ['TEXT IN A WARNING']...: status 0, the angle within the tolerance (rad), all that is said
read_right() {
    name=$1 tolerance=$2
    shift 2
    count=$((count + 1))
    "$run" "$name.yaml" --out "out/$name" --quiet > "$name.txt" 2> "$name.err" < /dev/null || fail "$name: $(cat "$name.err")"
    is=$(truth "out/$name")
    awk -v is="$is" -v most="$tolerance" 'BEGIN {exit !(is != "none" && is + 0 <= most)}' ||
        fail "$name: the angle is $is rad off: $(cat "$name.err")"
    for text in "$@"; do
        grep -qF -- "$text" "$name.err" || fail "$name: no warning with '$text': $(cat "$name.err")"
    done
    [ $# -gt 0 ] || [ ! -s "$name.err" ] || fail "$name: nothing is to be said: $(cat "$name.err")"
}

# refused NAME 'TEXT'...: status 2, nothing written, all of this said
refused() {
    name=$1
    shift
    count=$((count + 1))
    "$run" "$name.yaml" --out "out/$name" --quiet > "$name.txt" 2> "$name.err" < /dev/null
    status=$?
    [ $status -eq 2 ] && [ ! -d "out/$name" ] || fail "$name: status $status: $(cat "$name.err")"
    for text in "$@"; do
        grep -qF -- "$text" "$name.err" || fail "$name: no '$text' in: $(cat "$name.err")"
    done
}

# ---- made here ----

mkdir made && cd made || exit 1
cat > hinge.bioMod <<'END'
version 4
gravity 0 -9.81 0
segment fore
  rotations z
  ranges -0.2 2.6
  mass 1.5
  inertia 0.012 0 0 0 0.001 0 0 0 0.012
  com 0 -0.13 0
endsegment
marker ELB.L
  parent fore
  position 0.03 -0.02 0.04
endmarker
marker WRI.L
  parent fore
  position 0.02 -0.25 0.03
endmarker
marker WRI.M
  parent fore
  position -0.02 -0.25 -0.03
endmarker
END

# config NAME MODEL DATA [COSTS OF]
config() {
    cat > "$1.yaml" <<END
model: {file: $2}
data: {$3}
formulation: activation
horizon: {window: 5, ratio: 1}
bounds: {residual_torques: true}
output: {picture: false}
costs: [{plugin: mhe.cost.track, signal: ${4:-markers, sigma: 0.002}}, {plugin: mhe.cost.track, signal: residual_torque, value: [0], sigma: 10}]
solver: {plugin: mhe.solver.rti}
END
}

# trc RATE ROW-PROGRAM [LABELS] [UNITS]: the markers; the program may change row k's cells c[1..9] (mm), time t and text `row`
trc() {
    awk -v rate="$1" -v labels="${3:-ELB.L WRI.L WRI.M}" -v units="${4:-mm}" 'BEGIN {
        pi = atan2(0, -1); split("30 -20 40 20 -250 30 -20 -250 -30", p, " "); n = split(labels, l, " ")
        print "PathFileType\t4\t(X/Y/Z)\tmade.trc"
        print "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
        print rate "\t" rate "\t40\t" n "\t" units "\t" rate "\t1\t40"
        head = "Frame#\tTime"; for (i = 1; i <= n; i++) head = head "\t" l[i] "\t\t"
        print head; print "\t\tX1\tY1\tZ1\n"
        for (k = 0; k < 40; k++) {
            t = k / rate; frame = k + 1; q = 0.5 + 0.3 * sin(1.6 * pi * t); time = sprintf("%.4f", t); cells = 9; more = ""
            for (i = 0; i < 3; i++) {
                c[3 * i + 1] = cos(q) * p[3 * i + 1] - sin(q) * p[3 * i + 2]
                c[3 * i + 2] = sin(q) * p[3 * i + 1] + cos(q) * p[3 * i + 2]
                c[3 * i + 3] = p[3 * i + 3]
            }
            '"$2"'
            row = frame "\t" time
            for (i = 1; i <= cells; i++) row = row "\t" (c[i] == "" ? "" : sprintf("%.5f", c[i]))
            print row more
        }}'
}

# mot HEADER SCALE [ROW-PROGRAM]: the angle
mot() {
    awk -v head="$1" -v scale="$2" 'BEGIN {pi = atan2(0, -1); printf "%s\nendheader\ntime\tfore_RotZ\n", head
        for (k = 0; k < 40; k++) {t = k / 100; time = sprintf("%.4f", t); '"${3:-}"'
            printf "%s\t%.8f\n", time, scale * (0.5 + 0.3 * sin(1.6 * pi * t))}}'
}
deg=57.29577951308232

config good hinge.bioMod 'markers: good.trc'
trc 100 '' > good.trc
read_right good 0.005
config angles hinge.bioMod 'angles: good.mot' 'q, sigma: 0.005'
mot 'x
version=1
inDegrees=no' 1 > good.mot
read_right angles 0.005

# Encodings.
printf '\357\273\277' | cat - good.yaml > bom-config.yaml
read_right bom-config 0.005
printf '\357\273\277' | cat - hinge.bioMod > bom.bioMod
config bom bom.bioMod 'markers: bom.trc'
printf '\357\273\277' | cat - good.trc > bom.trc
read_right bom 0.005
(printf '// caf\351 \226\n'; sed 1,1b hinge.bioMod) > latin.bioMod
config latin latin.bioMod 'markers: latin.trc'
sed '1s/made/caf\xe9/' good.trc > latin.trc
read_right latin 0.005 'latin.bioMod:1: bytes that are no UTF-8 (2)' 'latin.trc:1: bytes that are no UTF-8 (1)'

# Names.
config near hinge.bioMod 'markers: near.trc'
trc 100 '' 'ELB.L WRI.L KNE.M' > near.trc
read_right near 0.005 'left out: KNE.M' 'no column for marker WRI.M'
config dots hinge.bioMod 'markers: dots.trc'
trc 100 '' 'elb_l WRI-L wri.m' > dots.trc
read_right dots 0.005 'elb_l as ELB.L'
config two hinge.bioMod 'markers: two.trc'
trc 100 'for (i = 1; i <= 9; i++) c[9 + i] = c[i] + 900; cells = 18' 'A:ELB.L A:WRI.L A:WRI.M B:ELB.L B:WRI.L B:WRI.M' > two.trc
refused two 'two subjects (A, B) have marker ELB.L' 'data.subject'
config one-of-two hinge.bioMod 'markers: two.trc, subject: a'
read_right one-of-two 0.005
config nobody hinge.bioMod 'markers: two.trc, subject: C'
refused nobody "has no subject 'C' (it has A, B)"
config map hinge.bioMod 'markers: map.trc, labels: {M1: ELB.L, M2: WRI.L, M3: WRI.M, M4: WRI.M}'
trc 100 '' 'M1 M2 M3' > map.trc
read_right map 0.005 'data.labels: no file has the column M4'
config twice hinge.bioMod 'markers: twice.trc'
trc 100 'for (i = 1; i <= 3; i++) c[9 + i] = 5; cells = 12' 'ELB.L WRI.L WRI.M ELB.L' > twice.trc
read_right twice 0.005 'stand twice' 'left out: ELB.L__4'

# Another frame: turned, shifted, scaled and mirrored back.
config turned hinge.bioMod 'markers: turned.trc, transform: {rotate: x-90, shift: [0.1, 0.2, -0.3]}'
trc 100 'for (i = 1; i <= 7; i += 3) {z = c[i + 1] - 200; y = -(c[i + 2] + 300); c[i] -= 100; c[i + 1] = y; c[i + 2] = z}' > turned.trc
read_right turned 0.005
config scaled hinge.bioMod 'markers: scaled.trc, transform: {rotate: [[0, 0, 1], 180], scale: -2}'
trc 100 'for (i = 1; i <= 9; i++) c[i] *= i % 3 == 0 ? -0.5 : 0.5' > scaled.trc
read_right scaled 0.005
config no-turn hinge.bioMod 'markers: good.trc, transform: {rotate: w90}'
refused no-turn "no-turn.yaml:2: data.transform: 'rotate' is an axis and degrees"

# What cannot be meant so: named, with a remedy that is a key and that helps.
# verdict NAME yes|doubtful|no 'TEXT'...: what the run says of itself on the terminal
verdict() {
    name=$1 usable=$2
    shift 2
    count=$((count + 1))
    "$run" "$name.yaml" --out "out/$name" --quiet > "$name.txt" 2> "$name.err" < /dev/null || fail "$name: $(cat "$name.err")"
    grep -qx "usable: $usable" "$name.txt" || fail "$name: not '$usable': $(cat "$name.txt")"
    grep -q "\"usable\":[[:space:]]*\"$usable\"" "out/$name/summary.json" || fail "$name: summary.json does not say $usable"
    for text in "$@"; do
        grep -qF -- "$text" "$name.txt" || fail "$name: no '$text' in: $(cat "$name.txt")"
    done
}
# remedied NAME KEYS: with them the same files give the right angle
remedied() {
    sed "s/^data: {\(.*\)}$/data: {\1, $2}/" "$1.yaml" > "$1-right.yaml"
    read_right "$1-right" 0.005
    grep -qx 'usable: yes' "$1-right.txt" || fail "$1: still not usable: $(cat "$1-right.txt")"
}
verdict good yes
config z-up hinge.bioMod 'markers: z-up.trc'
trc 100 'for (i = 1; i <= 7; i += 3) {y = c[i + 1]; c[i + 1] = -c[i + 2]; c[i + 2] = y}' > z-up.trc
verdict z-up no "its vertical does not fit the model's gravity" 'try: data.transform: {rotate: x-90}'
remedied z-up 'transform: {rotate: x-90}'
config origin hinge.bioMod 'markers: origin.trc'
trc 100 'for (i = 1; i <= 7; i += 3) {c[i] += 300; c[i + 1] += 150; c[i + 2] -= 200}' > origin.trc
verdict origin no 'all markers are off by the same 0.300 0.150 -0.200 m' 'data.transform: {shift: [-0.300, -0.150, 0.200]}'
remedied origin 'transform: {shift: [-0.300, -0.150, 0.200]}'
config glass hinge.bioMod 'markers: glass.trc'
trc 100 'c[1] = -c[1]; c[4] = -c[4]; c[7] = -c[7]' > glass.trc
verdict glass no 'those of a mirrored body' 'scale: -1}'
config hall hinge.bioMod 'markers: hall.trc'
trc 100 'for (i = 1; i <= 7; i += 3) {y = c[i + 1]; c[i] += 1000; c[i + 1] = -c[i + 2] + 2000; c[i + 2] = y + 3000}' > hall.trc
refused hall 'turned by 90 degrees' 'data.transform: {rotate: x-90, shift: [-1.000, -3.000, 2.000]}'
remedied hall 'transform: {rotate: x-90, shift: [-1, -3, 2]}'
config exchanged hinge.bioMod 'markers: exchanged.trc'
sed '4s/WRI.L/X/;4s/WRI.M/WRI.L/;4s/X/WRI.M/' good.trc > exchanged.trc
verdict exchanged no 'markers WRI.L and WRI.M look exchanged' 'data.labels: {WRI.L: WRI.M, WRI.M: WRI.L}'
remedied exchanged 'labels: {WRI.L: WRI.M, WRI.M: WRI.L}'
config inches hinge.bioMod 'markers: inches.trc'
trc 100 'for (i = 1; i <= 9; i++) c[i] /= 25.4' > inches.trc
verdict inches no 'a body 0.03937 times as large as the model' 'data.transform: {scale: 25.4}'
remedied inches 'transform: {scale: 25.4}'
config taller hinge.bioMod 'markers: taller.trc'
trc 100 'for (i = 1; i <= 9; i++) c[i] *= 1.15' > taller.trc
verdict taller doubtful 'a body 1.15 times as large as the model' 'scale the model (mhe-model scale)'
config degrees hinge.bioMod 'angles: degrees.mot' 'q, sigma: 0.005'
mot 'version=1' $deg > degrees.mot
refused degrees "degrees.mot:4: 'fore_RotZ' goes from 28.6" "'inDegrees=yes' in the header"
config still hinge.bioMod 'markers: still.trc'
trc 100 'if (k > 20) for (i = 1; i <= 3; i++) c[i] = held[i]; else for (i = 1; i <= 3; i++) held[i] = c[i]' > still.trc
verdict still doubtful 'repeat to the last digit: ELB.L'

# Rows, gaps, times, units.
config zeros hinge.bioMod 'markers: zeros.trc'
trc 100 'if (k < 20) for (i = 1; i <= 6; i++) c[i] = 0' > zeros.trc
read_right zeros 0.005 '40 samples of a marker at exactly 0 0 0'
config broken hinge.bioMod 'markers: broken.trc'
trc 100 'if (k % 5 == 0) {c[1] = 1e30; c[5] = -3e12}' > broken.trc
read_right broken 0.005 'samples of a marker are more than 100 km away'
config unseen hinge.bioMod 'markers: unseen.trc'
trc 100 'if (k % 4 == 0) c[1] = c[2] = c[3] = 9999' > unseen.trc
read_right unseen 0.005 '10 samples of a marker have the same number three times (9.999 m)'
config words hinge.bioMod 'markers: words.trc'
awk -F '\t' 'BEGIN {OFS = FS} NR > 6 && NR % 4 == 0 {$3 = "NA"; $4 = "NULL"; $5 = "#N/A"}
    NR > 6 && NR % 4 == 1 {$6 = $7 = $8 = "-"} {print}' good.trc > words.trc
read_right words 0.005
config commas hinge.bioMod 'markers: commas.trc'
sed '7,$s/\([0-9]\)\.\([0-9]\)/\1,\2/g' good.trc > commas.trc
read_right commas 0.005 "numbers with a comma ("
config quoted hinge.bioMod 'markers: quoted.trc'
sed '4s/ELB.L/"ELB.L"/;4s/WRI.M/WRI.M*/' good.trc > quoted.trc
read_right quoted 0.005 'ELB.L'
config nameless hinge.bioMod 'markers: nameless.trc'
sed '4s/WRI.L//' good.trc > nameless.trc
read_right nameless 0.005 'no label'
config beyond hinge.bioMod 'markers: beyond.trc'
trc 100 'if (k % 3 == 0) more = "\t1\t2\t3"' > beyond.trc
read_right beyond 0.005 'what is beyond is left out'
config cut hinge.bioMod 'markers: cut.trc'
trc 100 'if (k > 9 && k < 14) cells = 6' > cut.trc
read_right cut 0.005 'the rest is taken as missing'
config rounded hinge.bioMod 'markers: rounded.trc'
trc 240 'time = sprintf("%.2f", t)' > rounded.trc
read_right rounded 0.005 'taken as even at 240 Hz'
config again hinge.bioMod 'angles: again.mot' 'q, sigma: 0.005'
mot 'version=1' 1 'if (k == 39) {time = sprintf("%.2f", 0.38)}' > again.mot
read_right again 0.005 '1 row has the time of the one before it'
config pause hinge.bioMod 'markers: pause.trc'
trc 100 'if (k < 15) {} else {t += 0.12; q = 0.5 + 0.3 * sin(1.6 * pi * t); time = sprintf("%.4f", t); frame += 12
    for (i = 0; i < 3; i++) {c[3 * i + 1] = cos(q) * p[3 * i + 1] - sin(q) * p[3 * i + 2]
        c[3 * i + 2] = sin(q) * p[3 * i + 1] + cos(q) * p[3 * i + 2]}}' > pause.trc
read_right pause 0.01 '0.12 s without frames after 0.14 s: begins again there'
config jitter hinge.bioMod 'markers: jitter.trc'
trc 100 'time = sprintf("%.6f", t + 0.003 * sin(37 * k * k))' > jitter.trc
read_right jitter 0.005 'ms about an even 100 Hz, on which they are put'
config stamped hinge.bioMod 'angles: stamped.mot' 'q, sigma: 0.005' # no rate in its header
mot 'version=1' 1 'time = sprintf("%.6f", t + 0.003 * sin(37 * k * k))' > stamped.mot
read_right stamped 0.005 'Hz, on which they are put'
config counted hinge.bioMod 'markers: counted.trc'
trc 100 'time = frame' > counted.trc
read_right counted 0.005 "the times are the frames' numbers"
config unit hinge.bioMod 'markers: unit.trc'
trc 100 '' '' 'Millimeters' > unit.trc
read_right unit 0.005
trc 100 '' '' 'furlong' > unit.trc
read_right unit 0.005 "Units 'furlong'"

# Degrees.
config simm hinge.bioMod 'angles: simm.mot' 'q, sigma: 0.005'
mot 'flex
datacolumns 2
datarows 40' $deg > simm.mot
read_right simm 0.005 'angles are taken as degrees'

# What a download left in a file's place.
config pointer hinge.bioMod 'markers: pointer.trc'
printf 'version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 3730\n' > pointer.trc
refused pointer 'pointer.trc:1: a pointer of Git LFS'
config web web.bioMod 'markers: good.trc'
printf '\n<!DOCTYPE html>\n<html><body>Not found</body></html>\n' > web.bioMod
refused web 'web.bioMod:1: a web page'

# Models.
config light light.bioMod 'markers: good.trc'
sed 's/-9.81/-1/' hinge.bioMod > light.bioMod
read_right light 0.005 'gravity is 1 m/s2; is it in parts of 9.81 m/s2?'
config upper upper.bioMod 'markers: good.trc'
sed 's/^\(segment\|marker\|end.*\|  parent\|  rotations\)/\U\1/' hinge.bioMod > upper.bioMod
read_right upper 0.005
config double double.bioMod 'markers: good.trc'
(cat hinge.bioMod; printf 'marker ELB.L\n parent fore\n position 9 9 9\nendmarker\n') > double.bioMod
read_right double 0.005 "double.bioMod:22: marker 'ELB.L' is there twice: the first, in line 10, is used"
config glow glow.bioMod 'markers: good.trc'
(cat hinge.bioMod; printf 'glow G\n parent fore\n Type X\nendglow\n') > glow.bioMod
refused glow "glow.bioMod:22: glow 'G'" 'model.unsupported: warn'
sed -i 's/file: glow.bioMod/file: glow.bioMod, unsupported: warn/' glow.yaml
read_right glow 0.005 "glow.bioMod:22: glow 'G'"
config mirror mirror.bioMod 'markers: mirror.trc'
sed 's/^  rotations z/  rtinmatrix 1\n  rt 1 0 0 0  0 1 0 0  0 0 -1 0  0 0 0 1\n  rotations z/' hinge.bioMod > mirror.bioMod
trc 100 'c[3] = -c[3]; c[6] = -c[6]; c[9] = -c[9]' > mirror.trc
read_right mirror 0.005 "mirror.bioMod:3: the frame of body 'fore' is left-handed"

# ---- as they were found ----

cd .. || exit 1
if [ -d "$shared" ]; then
    cp -r "$shared" found && chmod -R u+w found && cd found || exit 1
    for name in good good-angles c3d-data-start-0 bom-config bom-model upper-case; do
        read_right $name 0.005
    done
    read_right simm-degrees 0.005 'angles are taken as degrees'
    read_right near-name 0.005 'left out: KNE.M, ANK.M' 'no column for marker WRI.M'
    read_right dropped-frames 0.005 '0.12 s without frames after 0.14 s: begins again there'
    ! grep -q 'taken as even' dropped-frames.err || fail "dropped-frames: taken as even"
    read_right zeros-missing 0.005 '40 samples of a marker at exactly 0 0 0'
    ! grep -q 'check the place' zeros-missing.txt || fail "zeros-missing: a marker is to be moved: $(cat zeros-missing.txt)"
    read_right trc-unlabelled 0.005 'what is beyond is left out'
    read_right trc-cut-rows 0.005 'the rest is taken as missing'
    read_right trc-time-2-decimals 0.005 'taken as even at 240 Hz'
    read_right time-twice 0.005 '1 row has the time of the one before it'
    read_right dup-marker 0.005 "dup-marker.bioMod:22: marker 'ELB.L' is there twice"
    read_right latin1-osim 0.005 'latin1-osim.osim:3: bytes that are no UTF-8'
    read_right label-dots 0.005 'ELB_L as ELB.L'
    verdict good yes
    verdict lab-z-up no "its vertical does not fit the model's gravity" 'try: data.transform: {rotate: x-90}'
    remedied lab-z-up 'transform: {rotate: x-90}'
    verdict lab-origin no 'all markers are off by the same 0.300 0.150 -0.200 m' 'data.transform: {shift: [-0.300, -0.150, 0.200]}'
    remedied lab-origin 'transform: {shift: [-0.3, -0.15, 0.2]}'
    verdict left-handed-joint no 'mirrored'
    grep -q "left-handed-joint.bioMod:3: the frame of body 'fore' is left-handed" left-handed-joint.err || fail "left-handed-joint: no line"
    refused degrees-unsaid "degrees-unsaid.mot:7: 'flex' goes from 28.6" 'its range is -0.2 to 2.6 rad' 'inDegrees=yes'
    refused emg-percent 'emg-percent.sto: values from' 'percent?'
    refused two-subjects 'two subjects (A, B) have marker ELB.L'
    refused fatigue "fatigue.bioMod:35: fatigueparameters of muscle 'FLEX'"
    sed -i 's/file: fatigue.bioMod/file: fatigue.bioMod, unsupported: warn/' fatigue.yaml
    read_right fatigue 0.005 "fatigue.bioMod:35: fatigueparameters of muscle 'FLEX'"
fi

finish "$count files"
