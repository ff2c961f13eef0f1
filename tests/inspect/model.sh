#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-model: what info and evaluate say of the arm that is shipped, and every kind of wrong input.
#   model.sh PATH/mhe-model SOURCE_DIR
set -u
model=$1
arm=$2/models/arm19/arm19.osim
. "$(dirname "$0")/../support/script.sh"

# says NAME 'TEXT' arguments: status 0, the text is in the answer
says() {
    name=$1 text=$2
    shift 2
    "$model" "$@" > answer 2> stderr.txt || fail "$name: status $?: $(cat stderr.txt)"
    grep -qF -- "$text" answer || fail "$name: '$text' is not in the answer"
}

# refuses NAME 'TEXT' arguments: status 2, one line with the text
refuses() {
    name=$1 text=$2
    shift 2
    "$model" "$@" > answer 2> stderr.txt
    status=$?
    [ $status -eq 2 ] || fail "$name: status $status"
    [ "$(grep -c . stderr.txt)" -eq 1 ] || fail "$name: not one line: $(cat stderr.txt)"
    grep -qF -- "$text" stderr.txt || fail "$name: '$text' is not in: $(cat stderr.txt)"
}

says coordinates 'LowerArm1_RotZ               -28.65 .. 120.3 deg' info "$arm"
says muscles 'BRA                          Thelen2003' info "$arm"
says crossed '"crosses":	["LowerArm1_RotZ"]' info "$arm" --json
says help 'mhe-model info MODEL' --help

echo '{"poses": [{"q": {"LowerArm1_RotZ": 0.5}}, {"q": {"LowerArm1_RotZ": 0.5}, "u": {"Arm_RotX": 1},
  "activation": {"BRA": 0.3}, "forces": {"BRA": 100},
  "external": [{"body": "LowerArm1", "force": [0, 0, 10], "point": [0, 0, 0]}]}]}' > poses.json
says angle '"LowerArm1_RotZ":0.5' evaluate "$arm" --poses poses.json
says muscle '"muscles":{"BRA":{"fiber_length":' evaluate "$arm" --poses poses.json
says reaction '"reactions":{' evaluate "$arm" --poses poses.json
"$model" evaluate "$arm" --poses poses.json --out out.json || fail "out: status $?"
"$model" evaluate "$arm" --poses poses.json | cmp -s - out.json || fail "out: file and stdout differ"

refuses command "'inform'" inform "$arm"
refuses 'no model' 'which model?' info
refuses 'no poses' '--poses FILE.json' evaluate "$arm"
refuses 'option of the other' '--poses' info "$arm" --poses poses.json
refuses 'no such file' 'nowhere.osim' info nowhere.osim
refuses 'not a model' 'poses.json' info poses.json
printf '{"poses": [\n{"q": }]}' > bad.json
refuses 'not JSON' 'bad.json:2: not JSON' evaluate "$arm" --poses bad.json
echo '{"pose": []}' > bad.json
refuses 'no list' 'there is no list "poses"' evaluate "$arm" --poses bad.json
echo '{"poses": [{}, {"u": {"LowerArm1_Rotz": 1}}]}' > bad.json
refuses coordinate "pose 1: \"u\" names an unknown coordinate 'LowerArm1_Rotz' (did you mean 'LowerArm1_RotZ'?)" \
    evaluate "$arm" --poses bad.json
echo '{"poses": [{"q": {"LowerArm1_RotZ": "bent"}}]}' > bad.json
refuses 'no number' 'is no number' evaluate "$arm" --poses bad.json
echo '{"poses": [{"forces": {"BRAC": 1}}]}' > bad.json
refuses muscle "names an unknown muscle 'BRAC' (did you mean 'BRA'?)" evaluate "$arm" --poses bad.json
echo '{"poses": [{"external": [{"body": "Arm", "force": [1, 2]}]}]}' > bad.json
refuses vector 'takes 3 numbers' evaluate "$arm" --poses bad.json
refuses paths 'exact or fitted' evaluate "$arm" --poses poses.json --paths short
cat > still.osim <<'END'
<OpenSimDocument Version="40000"><Model name="still"><BodySet><objects><Body name="b"><mass>1</mass></Body></objects></BodySet>
<JointSet><objects><WeldJoint name="w"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/b</socket_child_frame></WeldJoint></objects></JointSet></Model></OpenSimDocument>
END
refuses 'nothing to sweep' 'still.osim: ' sweep still.osim
refuses 'nothing moves' 'the model has no coordinate' sweep still.osim
echo '{"poses": [{}]}' > none.json
refuses 'no pose' 'still.osim: ' evaluate still.osim --poses none.json
says sweep 'jumps over 1 mm: 0' sweep "$arm"
[ $failed -eq 0 ] || exit 1
