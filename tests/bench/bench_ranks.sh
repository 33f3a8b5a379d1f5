#!/usr/bin/env bash
# vdi bench on several ranks, and its long suites on one. $1: vdi, $2: mpirun and its options, as one word list, $3: icet
# if vdi was built with it.
set -uo pipefail
vdi=$1
read -r -a mpirun <<<"$2"
# shellcheck source=tests/apps/works.sh
source "$(dirname "$0")/../apps/works.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1

# holds <what>: the Python program from standard input finds nothing wrong.
holds() {
  python3 - || { fail "$1"; cat out.txt err.txt; }
}
small=(--fields interface --size 24x20x18 --resolution 80x60 --supersegments 8 --repeats 2)

# Stages, bytes and sub-supersegments.
works "bench on 3 ranks" "${mpirun[@]}" 3 "$vdi" bench "${small[@]}" --frames 2 --angles 0 --blocks 3x2x2 -o three.json
cp out.txt table.txt
works "bench on 1 rank" "$vdi" bench "${small[@]}" --frames 2 --angles 0 -o one.json
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
    picture = row["picture_stages"][name]["wall_ms"]
    assert picture["slowest"] >= picture["mean"] > 0 and row["volume_rendering_ms"] > 0.5 * picture["mean"], row
    if name != "generate":
        assert row[name + "_ms"] == wall["slowest"], row
device = row["stages"]["generate"]["device_ms"]
assert row["generate_ms"] == device["slowest"] >= device["mean"] > 0, row
assert row["stages"]["composite"]["device_ms"]["slowest"] > 0, row
assert row["sub_supersegments"] >= row["supersegment_count"] > 0, row
assert row["bytes_sent"] > 0 and row["volume_rendering_ms"] > 0 and row["shown_ms"] > 0, row
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

# Suite ranks: every layout on 1, 2 and 3 ranks, of a fixed and of a growing volume.
works "suite ranks" "${mpirun[@]}" 3 "$vdi" bench --suite ranks "${small[@]}" --frames 1 --blocks 4x2x2 \
  --size-per-rank 12x10x8 -o ranks.json
holds "suite ranks" <<'P'
import json
document = json.load(open("ranks.json"))
rows = {(row["scaling"], row["layout"], row["ranks"]): row for row in document["rows"]}
layouts = ("slabs", "interleaved", "random")
assert len(document["rows"]) == len(rows) == 18 and document["ranks"] == 3, rows.keys()
for (scaling, layout, ranks), row in rows.items():
    size = row["size"]
    if scaling == "strong":
        assert size == [24, 20, 18], row
    else:  # the third axis is the shortest, then the second
        assert size == {1: [12, 10, 8], 2: [12, 10, 16], 3: [12, 10, 24]}[ranks], row
    blocks = row["blocks"][0] * row["blocks"][1] * row["blocks"][2]
    assert blocks == ranks if layout == "slabs" else blocks >= ranks, row
    assert row["frame_ms"] > 0 and row["generate_ms"] > 0 and row["volume_rendering_ms"] > 0, row
    assert row["sub_supersegments"] > 0, row
    assert (row["bytes_sent"] > 0) == (row["composite_ms"] is not None) == (ranks > 1), row
    one = rows[scaling, layout, 1]
    assert abs(row["frame_speedup"] * row["frame_ms"] - one["frame_ms"]) < 1e-6 * one["frame_ms"], row
    assert abs(row["vdis_speedup"] * one["vdis_per_second"] / row["vdis_per_second"] - 1) < 1e-6, row
P
works "ranks that were chosen" "${mpirun[@]}" 3 "$vdi" bench --suite ranks "${small[@]}" --frames 0 --scaling strong \
  --layouts slabs --rank-counts 2 -o two.json
holds "ranks that were chosen" <<'P'
import json
row, = json.load(open("two.json"))["rows"]
assert row["ranks"] == 2 and row["frame_speedup"] is None and row["vdis_per_second"] is None, row
P
works "a suite with itself" "$vdi" bench --compare ranks.json ranks.json
grep -q "^18 rows" out.txt || fail "rows of several rank counts are mixed up"
for wrong in "--rank-counts 3" "--layouts spiral" "--size-per-rank 5x5" "--scaling both"; do
  read -r -a options <<<"$wrong"
  fails "^vdi: " "${mpirun[@]}" 2 "$vdi" bench --suite ranks "${small[@]}" "${options[@]}"
done

# The other suites, which run on one rank.
single=(--size 24x20x16 --resolution 80x60 --supersegments 8)
works "bench all around" "$vdi" bench --suite viewpoints --fields turbulence "${single[@]}" --viewpoints 2 --zooms 4 \
  --margins 0 1 --truth-rate 2 -o around.json
holds "all around" <<'P'
import json
rows = json.load(open("around.json"))["rows"]
assert len(rows) == 4, len(rows)  # two margins, two kinds of viewpoints
row = {(r["views"], r["margin"]): r for r in rows}
cut, kept = (row["turned 20", margin] for margin in (0, 1))
assert cut["missing_most"] > 0.01 > 0.002 > kept["missing_most"], (cut, kept)
assert kept["ssim"] > cut["ssim"] and kept["stored_bytes"] > cut["stored_bytes"], (cut, kept)
P
works "bench on the way to a viewer" "$vdi" bench --suite stream --fields turbulence "${single[@]}" --frames 3 \
  --period 200 --rates 1Gbit -o stream.json
holds "on the way to a viewer" <<'P'
import json
rows = json.load(open("stream.json"))["rows"]
assert [row["way"] for row in rows] == ["live", "folder"], rows
for row in rows:
    assert row["frames_seen"] >= 2 and row["frames_per_second"] > 0 and row["age_ms"] > 0, row
    assert 0 < row["object_ssim_first"] <= row["object_ssim_full"] + 1e-3 <= row["ssim_full"] + 0.01, row
    assert row["encode_ms"] > 0 and row["step_ms"] > 0 and row["crowd_step_ratio"] > 0, row
P
fails "rates" "$vdi" bench --suite stream --fields sphere "${single[@]}" --rates fast -o x.json
fails "zooms" "$vdi" bench --suite viewpoints --fields sphere "${single[@]}" --zooms 0 -o x.json

# The rival: volume rendering composited by IceT has our picture, wherever the blocks are.
if [ "$3" != icet ]; then
  fails "built without IceT" "${mpirun[@]}" 2 "$vdi" bench --rival icet "${small[@]}"
  exit $((failures > 0))
fi
rival=(--rival icet --fields mixing --size 24x20x18 --resolution 80x60 --supersegments 8 --repeats 1 --frames 0)
for deal in "slabs 1x1x3 shared" "random 3x3x3 cells"; do
  read -r layout blocks joint <<<"$deal"
  # A camera that sees the slabs one behind the other, so that their order counts.
  works "rival, $deal" "${mpirun[@]}" 3 "$vdi" bench "${rival[@]}" --angles 0 --azimuth 155 --layout "$layout" \
    --blocks "$blocks" --joint "$joint" -o "rival_${layout}_$joint.json"
done
works "rival in the suite ranks" "${mpirun[@]}" 3 "$vdi" bench --suite ranks "${rival[@]}" --scaling strong \
  --layouts interleaved --blocks 4x3x3 --joint gap --parallel -o rival_ranks.json
holds "the rival" <<'P'
import json
for name in ("slabs_shared", "random_cells", "ranks"):
    for row in json.load(open(f"rival_{name}.json"))["rows"]:
        assert row["rival"] == "icet" and 0 <= row["rival_max_difference"] < 0.1, (name, row)
        assert row["rival_icet_ms"] >= row["rival_composite_ms"] > 0 and row["rival_render_ms"] > 0, (name, row)
        picture = row["width"] * row["height"] * 16
        assert row["ranks"] == 1 or 0 < row["rival_bytes_sent"] < 3 * picture, (name, row)
        convex = name == "slabs_shared" or row["ranks"] == 1
        assert (row["rival_redistribute_ms"] is None) == convex, (name, row)
        assert (row["rival_redistributed_bytes"] == 0) == convex, (name, row)
        values = 24 * 20 * 18 * 4  # and some that several blocks have
        assert row["rival_redistributed_bytes"] < 1.5 * values, (name, row)
P
fails "mpirun" "$vdi" bench --rival icet "${small[@]}"
exit $((failures > 0))
