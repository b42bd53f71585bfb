#!/bin/bash
# Runs odometry with several methods on several sequences, one after the other, and prints a markdown
# table: a row a sequence and method, then the mean over the sequences of APE / APE(points).
# Needs jq.
set -euo pipefail

usage() {
  cat <<USAGE
Usage: tests/benchmarks/table.sh [options] SEQ...
  --methods LIST   separated by commas (default: points-mono,points)
  --config FILE    YAML file for slcmap odometry
  --out DIR        keeps DIR/SEQ/METHOD (run, metrics.json) and DIR/SEQ/METHOD.log (default: build/table)
  --slcmap FILE    the program (default: build/bin/slcmap)
A sequence needs true poses: truth/trajectory.tum or mav0/state_groundtruth_estimate0/data.csv; lines are
those of the map, and are measured where there is truth/edges.csv.
USAGE
}

repository=$(cd "$(dirname "$0")/../.." && pwd)
methods="points-mono,points"
config=()
out=$repository/build/table
slcmap=$repository/build/bin/slcmap
sequences=()
while [ $# -gt 0 ]; do
  case $1 in
    --methods) methods=$2; shift 2 ;;
    --config) config=(--config "$2"); shift 2 ;;
    --out) out=$2; shift 2 ;;
    --slcmap) slcmap=$2; shift 2 ;;
    --help) usage; exit 0 ;;
    -*) echo "table.sh: unknown option $1" >&2; usage >&2; exit 2 ;;
    *) sequences+=("$1"); shift ;;
  esac
done
if [ ${#sequences[@]} -eq 0 ]; then usage >&2; exit 2; fi
command -v jq >/dev/null || { echo "table.sh: needs jq (apt-get install jq)" >&2; exit 1; }
IFS=, read -ra methods <<<"$methods"

truth_of() {
  local truth=$1/truth/trajectory.tum
  if [ -e "$truth" ]; then echo "$truth"; else echo "$1/mav0/state_groundtruth_estimate0/data.csv"; fi
}

# Runs one method on one sequence; what fails is reported in the log and has no metrics.json.
measure() {
  local sequence=$1 method=$2 folder=$3 edges=()
  rm -rf "$folder"
  mkdir -p "$folder"
  if [ -e "$sequence/truth/edges.csv" ]; then
    edges=(--true-edges "$sequence/truth/edges.csv" --lines "$folder/map/lines.ply")
  fi
  "$slcmap" odometry "$sequence" -o "$folder/run" --method "$method" "${config[@]}" &&
    "$slcmap" map "$folder/run" -o "$folder/map" "${config[@]}" &&
    "$slcmap" evaluate --truth "$(truth_of "$sequence")" --estimate "$folder/run/trajectory.tum" \
      "${edges[@]}" --json "$folder/metrics.json"
}

# A number with a format of printf, or - where it is missing.
cell() {
  if [ "$2" = null ]; then printf -- '-'; else printf "$1" "$2"; fi
}

row() {
  local sequence=$1 method=$2 folder=$3 points=$4
  if [ ! -e "$folder/metrics.json" ]; then
    echo "| $sequence | $method | failed | | | | | | | | | | | | |"
    return
  fi
  local ape rotation loop heading coverage cpu window iterations precision direction lines
  read -r ape rotation loop heading coverage precision direction < <(jq -r '
    (.lines.lines // 0) as $lines | [.ape.posyaw.position_m.rmse, .ape.posyaw.rotation_deg.rmse, .loop.percent_of_path,
     .heading_error_at_end_deg, 100 * .coverage.after_initialisation,
     ((.lines.scores // [])[] | select(.tolerance_m == 0.05 and $lines > 0) |
       100 * .precision) // null,
     .lines.accuracy.direction_mean_deg] | map(. // "null") | join(" ")' \
    "$folder/metrics.json")
  lines=$(jq -r '"\(.counts.lines) | \(.median_line_observations)"' "$folder/map/map.json")
  cpu=$(jq '1000 * .cpu_s / .stereo_frames' "$folder/run/timings.json")
  window=$(jq '[.stages[] | select(.name == "window optimisation") | 1000 * .wall_s / .calls][0]' \
    "$folder/run/timings.json")
  iterations=$(jq '.window_iterations as $n | [.stages[] | select(.name == "window optimisation") | $n / .calls][0]' \
    "$folder/run/timings.json")
  local ratio=null
  if [ -e "$points" ]; then
    ratio=$(jq -n --slurpfile a "$folder/metrics.json" --slurpfile b "$points" \
      '$a[0].ape.posyaw.position_m.rmse / $b[0].ape.posyaw.position_m.rmse')
    echo "$method $ratio" >>"$ratios"
  fi
  echo "| $sequence | $method | $(cell %.4f "$ape") | $(cell %.2f "$ratio") |" \
    "$(cell %.3f "$rotation") | $(cell %.3f "$loop") | $(cell %.3f "$heading") |" \
    "$(cell %.1f "$coverage") | $(cell %.1f "$cpu") | $(cell %.1f "$window") |" \
    "$(cell %.2f "$iterations") | $lines |" \
    "$(cell %.1f "$precision") | $(cell %.3f "$direction") |"
}

ratios=$(mktemp)
trap 'rm -f "$ratios"' EXIT
echo "| sequence | method | APE m | APE / points | rotation deg | loop % | heading at end deg |" \
  "coverage % | CPU ms/pair | window ms/keyframe | iterations/keyframe | lines | median life | precision at 5 cm % | direction deg |"
echo "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
for sequence in "${sequences[@]}"; do
  name=$(basename "$sequence")
  for method in "${methods[@]}"; do
    folder=$out/$name/$method
    mkdir -p "$out/$name"
    measure "$sequence" "$method" "$folder" >"$out/$name/$method.log" 2>&1 ||
      echo "table.sh: $name, $method: failed, see $out/$name/$method.log" >&2
  done
  for method in "${methods[@]}"; do
    row "$name" "$method" "$out/$name/$method" "$out/$name/points/metrics.json"
  done
done
echo
echo "Mean of APE / APE(points) over the sequences:"
awk '{ sum[$1] += $2; count[$1]++ } END { for (m in sum) printf "- %s: %.3f (%d sequences)\n", m,
  sum[m] / count[m], count[m] }' "$ratios" | sort
