#!/usr/bin/env bash
# From a bare Debian 12 to the page of a site: installs, builds, simulates three walks in two
# buildings, maps them, merges those of one building, places the other by its control points, and
# says what to open. A second run goes on where the first one was.
#
#   apps/demo_site.sh [FOLDER]     default: out/site
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-$root/out/site}
slcmap=$root/build/bin/slcmap

# simulate NAME SCENE [SECONDS]
simulate() {
  [ ! -e "$out/walks/$1" ] || return 0
  rm -rf "$out/walks/$1.part"
  "$slcmap" simulate "$2" -o "$out/walks/$1.part" --rate 10 ${3:+--duration "$3"}
  mv "$out/walks/$1.part" "$out/walks/$1"
}

# simulate_office NAME WAYPOINTS
simulate_office() {
  cat >"$out/scenes/$1.yaml" <<SCENE
base: $root/config/scenes/office_floor.yaml
name: $1
trajectory: {kind: walk, speed_m_s: 0.8, corner_m: 0.3, stand_still_s: 0.6, waypoints_m: [$2]}
SCENE
  simulate "$1" "$out/scenes/$1.yaml"
}

echo "== Building"
packages=$(mktemp)
trap 'rm -f "$packages"' EXIT
echo snakemake >"$packages"
"$root/.ci/install_packages.sh" "$packages"
"$root/.ci/build.sh" slcmap

echo "== Simulating three walks"
mkdir -p "$out/scenes" "$out/walks"
out=$(cd "$out" && pwd)
simulate_office office_west "[0.9, 0, 1.5], [10.5, 0.1, 1.5]"
simulate_office office_east "[4.5, 0, 1.5], [14.8, 0, 1.5]"
simulate lab "$root/config/scenes/surveyed_room.yaml" 16

echo "== Mapping the site"
cat >"$out/site.yaml" <<SITE
recordings:
  - {path: walks/office_*, building: office}
  - {path: walks/lab, building: lab}
control:
  - {building: lab, points: walks/lab/truth/control.csv, crs: "EPSG:25832"}
exports: [page, ifc]
SITE
"$slcmap" batch "$out/site.yaml" -o "$out/site"

echo "== Open in a browser"
echo "the site      $out/site/status.html"
