#!/usr/bin/env bash
# Starts the real ParaView with the plugin on a virtual screen (run this through xvfb-run), lets
# gui.py use it, takes a picture of the whole window, and ends ParaView. Needs VDI_PLUGIN and
# VDI_TEST_OUTPUT.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
done_file=$VDI_TEST_OUTPUT/gui.done
rm -f "$done_file"
export VDI_TEST_SOURCE=$here
export HOME=$VDI_TEST_OUTPUT/home # no settings of the user's, and none left behind
mkdir -p "$HOME"
paraview --disable-registry --script="$here/gui.py" >"$VDI_TEST_OUTPUT/gui.log" 2>&1 &
paraview_pid=$!
trap 'kill "$paraview_pid" 2>/dev/null || true' EXIT
for _ in $(seq 120); do
  [ -s "$done_file" ] && break
  if ! kill -0 "$paraview_pid" 2>/dev/null; then
    echo "ParaView ended by itself:" && tail -n 30 "$VDI_TEST_OUTPUT/gui.log"
    exit 1
  fi
  sleep 1
done
[ -s "$done_file" ] || { echo "ParaView did not finish the script in time"; tail -n 30 "$VDI_TEST_OUTPUT/gui.log"; exit 1; }
sleep 3 # let it paint
import -window root "$VDI_TEST_OUTPUT/gui.png"
cat "$done_file"
[ "$(cat "$done_file")" = ok ]
# A window that shows something has more than a handful of colours.
colors=$(identify -format %k "$VDI_TEST_OUTPUT/gui.png")
[ "$colors" -gt 500 ] || { echo "the window shows only $colors colours"; exit 1; }
