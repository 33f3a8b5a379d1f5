#!/usr/bin/env bash
# vdi bench on several ranks. $1: vdi, $2: mpirun and its options, as one word list.
set -uo pipefail
vdi=$1
read -r -a mpirun <<<"$2"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
failures=0

# works <what> command...: exit status 0.
works() {
  local what=$1
  shift
  "$@" >out.txt 2>err.txt || { echo "FAILED  $what: status $?"; cat out.txt err.txt; failures=$((failures + 1)); }
}
# holds <what>: the Python program from standard input finds nothing wrong.
holds() {
  python3 - || { echo "FAILED  $1"; cat out.txt err.txt; failures=$((failures + 1)); }
}
small=(--fields interface --size 24x20x18 --resolution 80x60 --supersegments 8 --repeats 2 --frames 2)

# Stages, bytes and sub-supersegments.
works "bench on 3 ranks" "${mpirun[@]}" 3 "$vdi" bench "${small[@]}" --angles 0 --blocks 3x2x2 -o three.json
cp out.txt table.txt
works "bench on 1 rank" "$vdi" bench "${small[@]}" --angles 0 -o one.json
holds "figures of stages" <<'P'
import json
table = open("table.txt").read()
row, = json.load(open("three.json"))["rows"]
assert row["ranks"] == 3, row
for name in ("generate", "distribute", "composite", "gather"):
    stage = row["stages"][name]
    wall = stage["wall_ms"]
    assert wall["slowest"] >= wall["mean"] > 0, (name, wall)
    assert row["frame_ms"] > 0.5 * wall["mean"], row
    assert name in table and f"{wall['slowest']:.3f}" in table, (name, table)
    if name != "generate":
        assert row[name + "_ms"] == wall["slowest"], row
device = row["stages"]["generate"]["device_ms"]
assert row["generate_ms"] == device["slowest"] >= device["mean"] > 0, row
assert row["sub_supersegments"] > row["supersegment_count"] > 0, row
assert row["bytes_sent"] > 0 and row["volume_rendering_ms"] > 0, row
assert row["orbit_frames"] == 2 and row["vdis_per_second"] > 0, row
alone, = json.load(open("one.json"))["rows"]
assert alone["ranks"] == 1 and alone["bytes_sent"] == 0, alone
assert alone["distribute_ms"] is alone["composite_ms"] is alone["gather_ms"] is None, alone
assert list(alone["stages"]) == ["generate"] and alone["frame_ms"] >= alone["generate_ms"] > 0, alone
P
works "no orbit" "$vdi" bench "${small[@]}" --angles 0 --frames 0 -o none.json
holds "no orbit" <<'P'
import json
row, = json.load(open("none.json"))["rows"]
assert row["vdis_per_second"] is None and row["orbit_frames"] == 0, row
P
exit $((failures > 0))
