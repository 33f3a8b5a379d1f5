#!/usr/bin/env bash
# By mouse and keyboard in the real ParaView with a window manager, in a virtual screen (run it through xvfb-run): opens a .vdi
# file, applies, drags to orbit, and compares what is seen with the tool's picture for the same camera. mouse.py has ParaView's
# side. Needs VDI_PLUGIN, VDI_TOOL and VDI_TEST_OUTPUT.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
output=$VDI_TEST_OUTPUT
export VDI_TEST_SOURCE=$here
export HOME=$output/mouse_home # no settings of the user's, and none left behind
rm -rf "$HOME" "$output"/mouse_* "$output"/mouse.*
mkdir -p "$HOME"
programs=()
trap 'kill "${programs[@]}" 2>/dev/null || true' EXIT

fail() {
  echo "FAILED  $1"
  import -window root "$output/mouse_failed.png"
  tail -n 20 "$output/mouse.log"
  exit 1
}

# await SECONDS WHAT COMMAND...: until the command succeeds.
await() {
  local seconds=$1 what=$2
  shift 2
  for _ in $(seq $((4 * seconds))); do
    "$@" >/dev/null 2>&1 && return
    sleep 0.25
  done
  fail "$what did not happen in $seconds s"
}

colors() { identify -format %k "$1"; }
# Of the middle of the view, as the screen shows it.
shows_something() {
  import -window root -crop 400x300+700+400 "$output/mouse_part.png"
  [ "$(colors "$output/mouse_part.png")" -gt 100 ]
}

"$VDI_TOOL" generate --field turbulence --size 32x32x32 --resolution 160x160 --supersegments 12 -o "$output/mouse_input.vdi" >/dev/null
openbox >/dev/null 2>&1 &
programs+=($!)
paraview --disable-registry --script="$here/mouse.py" >"$output/mouse.log" 2>&1 &
programs+=($!)
await 100 "ParaView's start" test -s "$output/mouse.ready"
[ "$(cat "$output/mouse.ready")" = ok ] || fail "$(cat "$output/mouse.ready")"
await 20 "ParaView's window" xdotool search --onlyvisible --name "ParaView 5"
window=$(xdotool search --onlyvisible --name "ParaView 5" | tail -n 1)
xdotool windowactivate --sync "$window" windowsize --sync "$window" 1280 960 windowmove --sync "$window" 0 0
sleep 2

# File, Open: the file's name, Return; then Apply.
xdotool key --window "$window" ctrl+o
await 20 "the dialog that opens files" xdotool search --onlyvisible --name "Open File"
dialog=$(xdotool search --onlyvisible --name "Open File" | tail -n 1)
xdotool windowactivate --sync "$dialog"
sleep 1
xdotool type --delay 20 "$output/mouse_input.vdi"
xdotool key Return
sleep 2
xdotool windowactivate --sync "$window"
xdotool key alt+a
await 40 "a picture of the opened file" shows_something
sleep 5 # all of its still pictures
import -window root "$output/mouse_opened.png"

# A drag across the view.
drag() {
  xdotool mousemove 800 500 mousedown 1
  for _ in $(seq 30); do
    xdotool mousemove_relative -- "$1" "$2"
    sleep 0.05
  done
  xdotool mouseup 1
}
compare_view() {
  await 60 "the end of the drag" test -s "$output/mouse_camera.json"
  sleep 3 # the still picture
  import -window root "$output/mouse_$1.png"
  pvpython "$here/mouse_compare.py" "$output/mouse_$1.png" || fail "$1"
}
drag 6 2
compare_view orbited
rm "$output/mouse_camera.json"
drag -3 -6
compare_view orbited_back
