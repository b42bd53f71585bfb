#!/usr/bin/env bash
# From a bare Debian 12 to a mapped building: installs, builds, simulates a walk through an office
# corridor, runs every stage on it, compares two methods, and says which files to open. A second run
# does not simulate again.
#
#   apps/demo.sh [FOLDER]     default: out/demo
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-$root/out/demo}
slcmap=$root/build/bin/slcmap
scene=$root/config/scenes/office_corridor.yaml
seconds=35

echo "== Building"
"$root/.ci/build.sh" slcmap

if [ ! -e "$out/sequence/.complete" ]; then
  echo "== Simulating $seconds s of a walk"
  rm -rf "$out/sequence"
  "$slcmap" simulate "$scene" -o "$out/sequence" --duration "$seconds"
  touch "$out/sequence/.complete"
fi

echo "== Mapping it"
"$slcmap" run "$out/sequence" -o "$out"

echo "== Comparing methods on it"
"$slcmap" compare "$out/sequence" -o "$out/report" --methods points,slc

echo "== Open in a browser"
if [ -e "$out/map.html" ]; then
  echo "the map       $out/map.html"
else
  echo "the map       is missing, as its page could not be built: see the warnings above"
fi
echo "the plan      $out/export/plan.pdf"
echo "the report    $out/report/report.html"
