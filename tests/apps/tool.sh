#!/usr/bin/env bash
# The tool as a user runs it, with good input and with bad. $1: vdi, $2: mpirun and its options, as
# one word list.
set -uo pipefail
vdi=$1
read -r -a mpirun <<<"$2"
# shellcheck source=tests/apps/works.sh
source "$(dirname "$0")/works.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
# compared <what> <condition on c> <options of compare...>: c, the output of vdi compare, meets the condition.
compared() {
  local what=$1 condition=$2
  shift 2
  works "$what" "$vdi" compare --json "$@"
  python3 -c "import json; c = json.load(open('out.txt')); assert $condition, c" || fail "$what"
}
small=(--size 24x20x16 --resolution 80x60 --supersegments 8)

# One rank and three give the same picture; the picture of the VDI from its own viewpoint is that picture.
works "generate" "$vdi" generate --field turbulence "${small[@]}" --joint cells -o one.vdi --flat one.png
works "generate on 3 ranks" "${mpirun[@]}" 3 "$vdi" generate --field turbulence "${small[@]}" --joint cells \
  --blocks 3x2x2 --layout random -o three.vdi --flat three.png
compared "ranks differ" "c['max_error'] <= 1" one.png three.png
works "render" "$vdi" render three.vdi -o turned.png --azimuth 0 20
compared "not the picture" "c['ssim'] > 0.995" one.png turned_0deg.png
compared "nothing turned" "c['ssim'] < 0.99" one.png turned_20deg.png
# Without --flat no rank ever has the whole VDI. The file must be the same.
works "written from where it is" "$vdi" generate --field turbulence "${small[@]}" --joint cells -o one_written.vdi
works "written on 3 ranks" "${mpirun[@]}" 3 "$vdi" generate --field turbulence "${small[@]}" --joint cells \
  --blocks 3x2x2 --layout random -o three_written.vdi
cmp one.vdi one_written.vdi || fail "the written file isn't the gathered one"
cmp three.vdi three_written.vdi || fail "on 3 ranks the written file isn't the gathered one"
refused 1 "no-such-folder" "${mpirun[@]}" 2 "$vdi" generate --field sphere "${small[@]}" -o no-such-folder/x.vdi
refused 1 "No space" "${mpirun[@]}" 2 "$vdi" generate --field sphere "${small[@]}" -o /dev/full
works "info" "$vdi" info one.vdi
grep -q "80 x 60" out.txt || fail "info doesn't print the resolution"
grep -q "compact precision" out.txt || fail "info doesn't print the precision"
grep -q "array .* of \(points\|cells\), from " out.txt || fail "info doesn't print array and range"
grep -q "opacity .* nodes from .*, unit distance " out.txt || fail "info doesn't print the opacity function"
works "full precision" "$vdi" generate --field turbulence "${small[@]}" --joint cells --precision full -o full.vdi --flat full.png
compared "compact isn't full's picture" "c['max_error'] <= 1" one.png full.png
[ $((2 * $(stat -c %s one.vdi))) -lt "$(stat -c %s full.vdi)" ] || fail "compact is no smaller"
works "render" "$vdi" render full.vdi -o turned.png --azimuth 20
works "render" "$vdi" render full.vdi -o constant.png --azimuth 20 --reconstruction constant
compared "constant isn't like smooth" "0.9 < c['ssim'] < 1" turned.png constant.png
refused 2 "reconstruction" "$vdi" render full.vdi -o x.png --reconstruction cubic
works "total budget" "$vdi" generate --field mixing "${small[@]}" --budget total --fill 0.5 -o need.vdi --flat need.png --dvr need_dvr.png
works "equal budget" "$vdi" generate --field mixing "${small[@]}" -o equal.vdi
[ $((10 * $(stat -c %s need.vdi))) -lt $((8 * $(stat -c %s equal.vdi))) ] || fail "the file with half of the supersegments is no smaller"
compared "with a total budget, V_O's picture differs" "c['max_error'] <= 1" need.png need_dvr.png
refused 2 "merge" "$vdi" generate --field sphere "${small[@]}" --budget total --algorithm bisection -o x.vdi
refused 2 "fill" "$vdi" generate --field sphere "${small[@]}" --fill 0.5 -o x.vdi
refused 2 "budget" "$vdi" generate --field sphere "${small[@]}" --budget each -o x.vdi
refused 2 "precision" "$vdi" generate --field sphere "${small[@]}" --precision double -o x.vdi
works "a lit part of a volume" "$vdi" generate --field mixing "${small[@]}" --shade --lights headlight --crop 0 0.7 0 1 0.1 1 \
  --clip 0.5 0.5 0.5 -1 0 0 --clip 0 0.1 0 0 1 0 -o lit.vdi
refused 2 "diffuse" "$vdi" generate --field sphere "${small[@]}" --shade --diffuse 2 -o x.vdi
refused 2 "cropping box" "$vdi" generate --field sphere "${small[@]}" --crop 1 0 0 1 0 1 -o x.vdi
refused 2 "normal" "$vdi" generate --field sphere "${small[@]}" --clip 0 0 0 0 0 0 -o x.vdi
refused 2 "termination" "$vdi" generate --field sphere "${small[@]}" --termination-opacity 0 -o x.vdi
# Pictures of other blend modes, one of them also on three ranks; a VDI refuses them.
for blend in maximum minimum "isosurface --isovalues 0.3 0.5 0.7"; do
  read -r -a mode <<<"$blend"
  works "$blend" "$vdi" generate --field mixing "${small[@]}" --joint cells --blend "${mode[@]}" --dvr blend_one.png
  compared "$blend: as composite" "c['ssim'] < 0.98" blend_one.png need_dvr.png
  refused 2 "composite blending only" "$vdi" generate --field mixing "${small[@]}" --blend "${mode[@]}" -o x.vdi --dvr x.png
done
works "isosurface on 3 ranks" "${mpirun[@]}" 3 "$vdi" generate --field mixing "${small[@]}" --joint cells --blocks 3x2x2 \
  --layout random --blend "${mode[@]}" --dvr blend_three.png
compared "isosurface: ranks differ" "c['ssim'] > 0.999" blend_one.png blend_three.png
refused 2 "at least one isovalue" "$vdi" generate --field mixing "${small[@]}" --blend isosurface --dvr x.png
refused 2 "need blend mode isosurface" "$vdi" generate --field mixing "${small[@]}" --isovalues 0.5 --dvr x.png
refused 2 "composite, maximum, minimum or isosurface" "$vdi" generate --field mixing "${small[@]}" --blend mip --dvr x.png
# A page of VDIs is the same each time. If it can't be made, the file stays as it was.
works "export" "$vdi" export one.vdi three.vdi -o page.html --title "<Two>"
grep -q '<title>&lt;Two&gt;</title>' page.html || fail "the page's title isn't escaped"
[ "$(grep -c 'class="vdi-frame"' page.html)" -eq 2 ] || fail "a page of two VDIs doesn't have two frames"
works "export again" "$vdi" export one.vdi three.vdi -o again.html --title "<Two>"
cmp page.html again.html || fail "equal VDIs give different pages"
head -c 3000 one.vdi >broken.vdi
refused 1 "invalid .vdi file" "$vdi" export one.vdi broken.vdi -o page.html
refused 1 "No such file" "$vdi" export one.vdi nowhere.vdi -o page.html
cmp page.html again.html || fail "a page that can't be made replaces the old one"
refused 1 "No space" "$vdi" export one.vdi -o /dev/full
refused 2 "overwrite" "$vdi" export one.vdi -o one.vdi
refused 2 "required" "$vdi" export -o page.html
# Lists beyond the picture's edges leave the picture unchanged, and show what turning brings into view. At higher rates,
# rays that are set up from another pixel round differently, and a pixel may be off by 1/255.
near=(--field turbulence "${small[@]}" --zoom 4 --sampling-rate 1)
works "generate" "$vdi" generate "${near[@]}" -o cut.vdi --flat cut.png
works "generate with a margin" "$vdi" generate "${near[@]}" --margin 1 -o kept.vdi --flat kept.png
cmp cut.png kept.png || fail "a margin changes the picture"
works "info" "$vdi" info kept.vdi
grep -q "picture *80 x 60, and a margin of" out.txt || fail "info doesn't print the margin"
works "render" "$vdi" render kept.vdi -o kept_again.png
compared "not the picture's own view" "c['max_error'] <= 2" kept.png kept_again.png
refused 2 "margin" "$vdi" generate "${near[@]}" --margin 5 -o x.vdi

touch linked.json
chmod 640 linked.json
ln -s linked.json bench.json
works "bench" "$vdi" bench --fields sphere "${small[@]}" --repeats 1 --angles 0 20 -o bench.json
if [ ! -h bench.json ] || [ "$(stat -c %a linked.json)" != 640 ]; then fail "a link or a file's mode was replaced"; fi
python3 - <<'P' || fail "bench.json isn't what it should be"
import json
bench = json.load(open("bench.json"))
assert bench["device"] and len(bench["rows"]) >= 2
assert all(row["dvr_ms"] is None or row["dvr_ms"] > 0 for row in bench["rows"])
assert all(row["sampling_rate"] == 1 and row["truth_rate"] == 8 for row in bench["rows"])
assert all(0.9 < row["dvr_ssim"] < 1 and 0.9 < row["ssim"] < 1 for row in bench["rows"])
P

# A raw volume of 16-bit big-endian cells behind a header.
python3 - <<'P'
import json
import struct
values = [(x * 200 + y * 90) % 4000 for z in range(6) for y in range(8) for x in range(10)]
open("v.raw", "wb").write(b"header" + struct.pack(">480H", *values))
json.dump({"file": "v.raw", "dims": [10, 8, 6], "type": "u16", "endianness": "big", "skip": 6, "association": "cell"},
          open("v.json", "w"))
for fill in 0, 7001:
    filled = [fill if i % 13 == 0 else value + 1 for i, value in enumerate(values)]
    open(f"f{fill}.raw", "wb").write(struct.pack("<480H", *filled))
    json.dump({"file": f"f{fill}.raw", "dims": [10, 8, 6], "type": "u16"}, open(f"f{fill}.json", "w"))
json.dump({"file": "v.raw", "dims": [10, 8, 7], "type": "u16"}, open("long.json", "w"))
json.dump({"file": "v.raw", "dims": [10, 8, 6], "type": "u12"}, open("type.json", "w"))
json.dump({"file": "v.raw", "dims": [10, 8, 6], "type": "u16", "spacin": [1, 1, 1]}, open("field.json", "w"))
P
# Missing values count neither in the picture nor in its range of colours, whichever number stands for them.
for fill in 0 7001; do
  works "missing values" "$vdi" generate --raw f$fill.json --missing $fill --resolution 40x30 --flat missing$fill.png
done
cmp missing0.png missing7001.png || fail "the number that stands for missing values shows"
works "no missing values" "$vdi" generate --raw f0.json --resolution 40x30 --flat filled.png
! cmp -s missing0.png filled.png || fail "--missing leaves nothing out"
# Each time step equals a run with that step alone, with the first step's camera and transfer function. The first volume is
# big-endian, behind a header.
python3 - <<'P'
import json
import struct
for step in range(3):
    values = [(x * 200 + y * 90 + step * 700) % 4000 for z in range(6) for y in range(8) for x in range(10)]
    values[:2] = 0, 4000
    described = {"file": f"s{step}.raw", "dims": [10, 8, 6], "type": "u16"}
    if step == 0:
        described.update(endianness="big", skip=6)
    open(f"s{step}.raw", "wb").write(struct.pack(">6x480H" if step == 0 else "<480H", *values))
    json.dump(described, open(f"s{step}.json", "w"))
json.dump({"file": "s9.raw", "dims": [10, 8, 6], "type": "u16"}, open("s9.json", "w"))
P
for step in 0 1 2; do works "a step" "$vdi" generate --raw s$step.json --resolution 40x30 --flat alone$step.png; done
works "steps on 2 ranks" "${mpirun[@]}" 2 "$vdi" generate --raw s0.json s1.json s2.json --resolution 40x30 --step 8 \
  --time 0.5 --interval 0.25 -o steps.vdi --flat steps.png
for step in 0 1 2; do
  compared "step $step isn't itself" "c['max_error'] <= 1" alone$step.png "$(printf 'steps_%04d.png' $((8 + step)))"
done
works "info" "$vdi" info steps_0008.vdi
grep -q "of points, from 0 to 4000" out.txt || { fail "a big-endian volume behind a header has other values"; cat out.txt; }
works "info" "$vdi" info steps_0009.vdi
if ! grep -q "step 9" out.txt || ! grep -q "0.75" out.txt; then
  fail "info doesn't print step and time"
  cat out.txt
fi
cp v.json $'\xff.json'
ln -s made.json bytes.json
works "bench of a name that isn't UTF-8" "$vdi" bench --raw $'\xff.json' --resolution 40x30 --repeats 1 --angles 0 -o bytes.json
if [ ! -h bytes.json ] || [ ! -f made.json ]; then fail "a link to no file was replaced"; fi
python3 -c "import json; assert json.load(open('bytes.json'))['rows'][0]['dataset']" || fail "a name's bytes broke the result"
refused 1 "s9.raw" "$vdi" generate --raw s0.json s9.json --resolution 40x30 -o x.vdi
refused 1 "long.json|v.raw" "$vdi" generate --raw long.json -o x.vdi
refused 1 "u12" "$vdi" generate --raw type.json -o x.vdi
refused 1 "spacin" "$vdi" generate --raw field.json -o x.vdi
refused 1 "none.json" "$vdi" generate --raw none.json -o x.vdi

# An unreadable step is left out and reported at the end; the steps before and after it are written.
refused 1 "time step 1: .*s9.raw" "${mpirun[@]}" 2 "$vdi" generate --raw s0.json s9.json s1.json s9.json s2.json \
  --resolution 40x30 --joint gap --flat left.png
for step in 0 2 4; do
  compared "step $step of a broken series" "c['max_error'] <= 1" alone$((step / 2)).png "$(printf 'left_%04d.png' $step)"
done
pictures=(left_*)
[ ${#pictures[@]} -eq 3 ] || fail "a broken series has other pictures"
works "a late step" "$vdi" generate --raw s0.json s1.json --resolution 40x30 --step 4294967301 -o late.vdi
works "info" "$vdi" info late_4294967302.vdi
grep -q "step 4294967302" out.txt || fail "a step has lost its large number"
refused 2 "step.*whole" "$vdi" generate --field sphere "${small[@]}" --step=-1 -o x.vdi
refused 2 "step.*whole" "$vdi" generate --field sphere "${small[@]}" --step 18446744073709551616 -o x.vdi
refused 2 "exceeds" "$vdi" generate --raw s0.json s1.json --step 18446744073709551615 -o x.vdi
refused 2 "finite" "$vdi" generate --field sphere "${small[@]}" --time nan -o x.vdi

# Each viewpoint from which the picture isn't true gets one warning.
warnings() { grep -c "^vdi: warning: .*$1" err.txt; }
works "no warning" "$vdi" render one.vdi -o x.png --azimuth -50 0 50
[ ! -s err.txt ] || { fail "there is a warning of a viewpoint near V_O"; cat err.txt; }
works "far beside" "$vdi" render one.vdi -o x.png --azimuth 90 180 --reconstruction constant
[ "$(warnings degrees)" -eq 1 ] || { fail "far beside: no warning, or several"; cat err.txt; }
works "inside" "$vdi" render one.vdi -o x.png --position 0.5 0.4 0.4 --focal-point 0 0 0
[ "$(warnings inside)" -eq 1 ] || { fail "inside: no warning"; cat err.txt; }
works "past it" "$vdi" render one.vdi -o x.png --position 9 9 9 --focal-point 20 20 20
[ "$(warnings "doesn't see")" -eq 1 ] || { fail "past it: no warning"; cat err.txt; }
rm -f x.png x_*.png

# A turn, as numbered pictures and as a movie. Encoding changes the pictures a little.
works "an orbit" "$vdi" render one.vdi --orbit 8 -o turn.png --azimuth 20
[ "$(find . -name 'turn_*.png' | wc -l)" -eq 8 ] || fail "an orbit of 8 pictures has another number"
works "a quarter later" "$vdi" render one.vdi -o quarter.png --azimuth 110
cmp turn_0002.png quarter.png || fail "the third of 8 pictures isn't a quarter of a turn later"
refused 1 "needs the program ffmpeg" env PATH=/nowhere "$vdi" render one.vdi --orbit 8 --movie turn.webm
if command -v ffmpeg >/dev/null; then
  works "a movie" "$vdi" render one.vdi --orbit 8 --movie turn.webm --azimuth 20 --rate 4
  works "its last picture" ffmpeg -loglevel error -y -ss 1.75 -i turn.webm -frames:v 1 last.png
  compared "the movie's pictures aren't those of the orbit" "c['ssim'] > 0.9" turn_0007.png last.png
fi
refused 1 "No such file" "$vdi" render one.vdi --orbit 8 --movie no-such-folder/turn.webm
refused 2 "must end in" "$vdi" render one.vdi --orbit 8 --movie turn.png
refused 2 "orbit" "$vdi" render one.vdi --movie turn.webm
refused 2 "one --azimuth" "$vdi" render one.vdi --orbit 8 -o x.png --azimuth 0 20
refused 2 "output" "$vdi" render one.vdi --orbit 8
[ -z "$(find . -name '*.part*')" ] || fail "parts of movies are left"
rm -f turn* quarter.png last.png

# Pipes given as input are refused, not waited for.
mkfifo pipe pipe.json
for option in "--camera pipe" "--transfer-function pipe.json"; do
  read -r -a words <<<"$option"
  refused 1 "a pipe .*pipe" timeout 20 "$vdi" generate --field sphere "${small[@]}" "${words[@]}" -o x.vdi
done
refused 1 "a pipe .*pipe" timeout 20 "$vdi" generate --raw pipe -o x.vdi
refused 1 "a pipe .*pipe" timeout 20 "$vdi" render pipe -o x.png
refused 1 "a pipe .*pipe" timeout 20 "$vdi" info pipe
refused 1 "a pipe .*pipe" timeout 20 "$vdi" compare pipe one.png
refused 1 "a pipe .*pipe" timeout 20 "$vdi" bench --compare bench.json pipe
echo '{"file": "pipe", "dims": [10, 8, 6], "type": "u16"}' >piped.json
refused 1 "a pipe .*pipe" timeout 20 "$vdi" generate --raw piped.json -o x.vdi
echo '{"position": [0, 0, 3], "focal_point": [0, 0, 0], "position": [0, 0, 4]}' >twice.json
refused 1 "'position' .*twice" "$vdi" generate --field sphere "${small[@]}" --camera twice.json -o x.vdi

# Output: no file is lost, and an output that can't be written is reported before any other error.
refused 1 "no-such-folder" "$vdi" generate --raw none.json -o no-such-folder/x.vdi
refused 1 "no-such-folder" "$vdi" render none.vdi -o no-such-folder/x.png
refused 1 "no-such-folder" "$vdi" bench --fields sphere --raw none.json -o no-such-folder/x.json
refused 2 "output: must name a file" "$vdi" generate --field sphere "${small[@]}" -o ""
refused 2 "output: must name a file" timeout 60 "$vdi" bench --fields sphere "${small[@]}" -o ""
refused 2 "angles" "$vdi" bench --fields sphere "${small[@]}" --angles 0 nan -o x.json
refused 2 "flat would overwrite .* -o" "$vdi" generate --field sphere "${small[@]}" -o x.vdi --flat ./x.vdi
refused 2 "would overwrite" "$vdi" render one.vdi -o one.vdi
refused 2 "would overwrite" "$vdi" render one.vdi -o x.png --azimuth 20.00000001 20.00000002
refused 2 "would overwrite the file of the raw" "$vdi" generate --raw v.json --flat v.raw
works "into devices" "$vdi" generate --field sphere "${small[@]}" -o /dev/null --flat /dev/null
[ -c /dev/null ] || fail "a device was replaced"
refused 1 "nobody reads" timeout 60 "$vdi" render one.vdi -o pipe
cat pipe >piped.png &
works "into a pipe" timeout 60 "$vdi" render one.vdi -o pipe
wait $!
works "compare" "$vdi" compare piped.png one.png
[ -p pipe ] || fail "a pipe was replaced"
for command in "info one.vdi" "compare one.png one.png" "bench --compare bench.json bench.json" "--help"; do
  refused 1 "standard output|No space" sh -c "'$vdi' $command >/dev/full"
  refused 1 "standard output|Bad file" sh -c "'$vdi' $command >&-"
done
[ -z "$(find . -name '*.tmp*')" ] || fail "temporary files were left"

# What a terminal would obey is printed as escapes.
odd=$(printf 'odd\033[31m\nname\302\233\377\342\200\256ü')
cp one.vdi "$odd.vdi"
works "info" "$vdi" info "$odd.vdi"
grep -qF 'odd\x1b[31m\nname\x9b\xff\u202eü.vdi' out.txt || fail "info prints control characters: $(cat -v out.txt)"
refused 1 'odd\\x1b\[31m\\nname' "$vdi" info "$odd"
[ "$(wc -l <err.txt)" -eq 1 ] || fail "a name takes several lines"
works "render" "$vdi" render "$odd.vdi" -o "$odd.png"
! grep -q "$(printf '\033')" out.txt err.txt || fail "render prints control characters"
rm "$odd"*

# Ranges of a few ulps.
echo '{"colors": [[300, 0, 0, 0], [300.00000000000006, 1, 1, 1]], "opacities": [[299, 0], [301, 1]]}' >narrow.json
works "generate" "$vdi" generate --field sphere --size 8x8x8 --resolution 8x8 --transfer-function narrow.json -o narrow.vdi
works "info" "$vdi" info narrow.vdi
grep -q "nodes from 300 to 300.00000000000006" out.txt || fail "info prints the same number for both ends: $(cat out.txt)"

# Bad input.
truncate -s 1T large.vdi large.png large.json
refused 1 "large.vdi" "$vdi" render large.vdi -o x.png
refused 1 "large.png" "$vdi" compare large.png one.png
refused 1 "large.json" "$vdi" generate --raw large.json -o x.vdi
rm large.*
echo '{"device": 5, "rows": [1]}' >odd.json
echo '{"a": tru}' >broken.json
refused 1 "line 1: not valid JSON: '}' isn't expected after '.*tru' .broken.json" "$vdi" generate --raw broken.json -o x.vdi
refused 1 "not a result .*odd.json" "$vdi" bench --compare odd.json bench.json
sed 's/"ssim": 0[.]/"ssim": 0.0/' bench.json >worse.json
refused 1 "regressions" "$vdi" bench --compare bench.json worse.json
head -c 200 one.vdi >short.vdi
refused 1 "short.vdi" "$vdi" render short.vdi -o x.png
refused 1 "v.json" "$vdi" info v.json
works "check" "$vdi" check '{"field": "V", "every": 10}'
grep -q "steps 0, 10, 20" out.txt || fail "check doesn't print the steps"
grep -q "vdi_000010.vdi" out.txt || fail "check doesn't print the files"
printf '{"field": "V",\n"camera": {"position": [0, 0]}}' >run.json
refused 1 "/camera/position: must be an array of 3 numbers .run.json, line 2." "$vdi" check run.json
works "check" "$vdi" check '{"field": "V", "log": "logs/run.jsonl"}'
grep -q "^log: logs/run.jsonl" out.txt || fail "check doesn't print the log"
mkdir -p there
cp one.vdi there/vdi_000003.vdi
run='{"field": "V", "every_time": 0.5, "every_seconds": 9, "when": {"max": "p", "above": 2}, "max_share": 0.05,
  "cameras": [{"name": "a", "orbit": {}}, {"name": "b", "orbit": {}}], "output": "there/vdi_{timestep:06d}.vdi"'
works "check" "$vdi" check "$run}"
grep -q "every 0.5 of the simulation's time and every 9 s, if p's maximum is above 2, in at most 5 % of the wall" out.txt ||
  fail "check doesn't print when frames are made"
works "check" "$vdi" check '{"field": "V", "output": "there/vdi_{timestep:06d}.vdi"}'
grep -q "there/vdi_000003.vdi exists already" out.txt || fail "check doesn't print what is in the way"
printf '{"field": "V",\n"when": {"max": "V"}}' >run.json
refused 1 "/when: must have a bound, 'above' or 'below' .run.json, line 2." "$vdi" check run.json
refused 1 "not a run's log .*odd.json" "$vdi" log odd.json
refused 2 "would overwrite" "$vdi" log odd.json -o odd.json
refused 1 "pipe.json" timeout 10 "$vdi" check pipe.json
refused 1 "none.json" "$vdi" check '{"field": "V", "colors": {"file": "none.json"}}'

mkdir -p follow
head -c 200 one.vdi >follow/vdi_000001.vdi  # still being written
timeout 60 "$vdi" render --follow follow -o now.png --azimuth 10 --frames 2 >follow.txt 2>follow_err.txt &
follower=$!
sleep 1
[ ! -e now.png ] || fail "a file that is still being written is shown"
cp one.vdi follow/vdi_000001.vdi
for _ in $(seq 100); do [ -e now.png ] && break; sleep 0.1; done
cp now.png first.png || fail "no picture of the first VDI in a followed folder"
cp need.vdi follow/.part && mv follow/.part follow/vdi_000002.vdi
wait $follower || { fail "render --follow: status $?"; cat follow.txt follow_err.txt; }
works "render one" "$vdi" render one.vdi -o expected.png --azimuth 10
cmp -s first.png expected.png || fail "the first picture of a followed folder isn't its VDI's"
works "render need" "$vdi" render need.vdi -o expected.png --azimuth 10
cmp -s now.png expected.png || fail "the last picture of a followed folder isn't the newest VDI's"
refused 1 "nowhere" "$vdi" render --follow nowhere -o now.png
refused 2 "follow" "$vdi" render one.vdi -o now.png --frames 2

refused 2 "nonsense" "$vdi" generate --field nonsense -o x.vdi
refused 2 "supersegments" "$vdi" generate --field sphere --supersegments 0 -o x.vdi
refused 2 "0x5" "$vdi" generate --field sphere --resolution 0x5 -o x.vdi
refused 2 "" "$vdi" frobnicate
refused 2 "VDI_BANDS is 'many'; it may be a whole number" env VDI_BANDS=many "$vdi" generate --field sphere "${small[@]}" -o x.vdi
refused 2 "VDI_VALIDATION is 'yes'; it may be 0 or 1" env VDI_VALIDATION=yes "$vdi" generate --field sphere "${small[@]}" \
  -o x.vdi
refused 2 "VDI_RANKS_PER_HOST is '-1'; it may be a whole number" "${mpirun[@]}" 1 env VDI_RANKS_PER_HOST=-1 "$vdi" \
  generate --field sphere "${small[@]}" -o x.vdi
# The second rank's environment is bad. Open MPI 5.0.7 crashes where each rank is given its own program.
# shellcheck disable=SC2016  # each rank's shell expands these
refused 2 "VDI_RANKS_PER_HOST is 'two'; it may be a whole number" "${mpirun[@]}" 2 sh -c \
  '[ "$OMPI_COMM_WORLD_RANK" = 0 ] || export VDI_RANKS_PER_HOST=two; exec "$@"' sh \
  "$vdi" generate --field sphere "${small[@]}" -o x.vdi
# A cache only saves time.
touch file
for cache in /proc/nope "$folder/file"; do
  works "a bad VDI_CACHE" env VDI_CACHE="$cache" "$vdi" generate --field sphere "${small[@]}" -o cached.vdi
  [ "$(grep -c "^vdi: warning: VDI_CACHE is '$cache'" err.txt)" = 1 ] || fail "no warning of VDI_CACHE=$cache"
done
works "a new VDI_CACHE" env VDI_CACHE="$folder/new/cache" "$vdi" generate --field sphere "${small[@]}" -o cached.vdi
! grep -q warning err.txt || fail "a warning of a cache's folder that can be made"
refused 1 "nothing-like-this" env VDI_DEVICE=nothing-like-this "$vdi" generate --field sphere "${small[@]}" -o x.vdi
refused 1 "no-such-folder" "$vdi" generate --field sphere "${small[@]}" -o no-such-folder/x.vdi
if [ -e x.vdi ] || [ -e x.png ]; then fail "a refused command left a file"; fi
exit $((failures > 0))
