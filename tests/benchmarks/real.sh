#!/bin/bash
# Runs all methods on EuRoC and TUM VI as downloaded and unpacked, and writes the tables of the
# SLC-VIO paper with the figures found beside them into BENCHMARK.md.
set -euo pipefail

usage() {
  cat <<USAGE
Usage: tests/benchmarks/real.sh [options] FOLDER [-- OPTION...]
  FOLDER           holds, at any depth, sequences with stereo images, IMU and true poses: EuRoC's
                   MH_01_easy/mav0, TUM VI's dataset-corridor1_512_16/mav0 with dso beside it;
                   and trajectories/SYSTEM/SEQUENCE.tum (or .txt, .csv) of other systems
  --only LIST      names of sequences, separated by commas (default: all)
  --out DIR        where runs and the report are kept; again, it goes on (default: build/real)
  --into FILE      whose real half is written (default: BENCHMARK.md)
  --slcmap FILE    the program (default: build/bin/slcmap)
  OPTION...        for slcmap compare: --repeats 3, --methods points,slc, --poses-of camera, ...
USAGE
}
fail() { echo "real.sh: $1" >&2; exit "${2:-1}"; }

repository=$(cd "$(dirname "$0")/../.." && pwd)
folder="" only="" out=$repository/build/real into=$repository/BENCHMARK.md
slcmap=$repository/build/bin/slcmap
while [ $# -gt 0 ]; do
  case $1 in
    --only) only=$2; shift 2 ;;
    --out) out=$2; shift 2 ;;
    --into) into=$2; shift 2 ;;
    --slcmap) slcmap=$2; shift 2 ;;
    --help) usage; exit 0 ;;
    --) shift; break ;;
    -*) usage >&2; fail "unknown option $1" 2 ;;
    *) folder=$1; shift ;;
  esac
done
[ -d "$folder" ] || { usage >&2; fail "found '$folder', expected a folder with recordings" 2; }
[ -x "$slcmap" ] || fail "$slcmap is missing: build it (.ci/build.sh slcmap), or name it by --slcmap" 2

sequences=() arguments=()
while read -r mav0; do
  sequence=$(dirname "$mav0")
  name=$(basename "$sequence")
  if [ -n "$only" ] && [[ ,$only, != *,$name,* ]]; then continue; fi
  lacks=""
  for sensor in cam0 cam1 imu0; do [ -d "$mav0/$sensor" ] || lacks="$lacks $sensor"; done
  [ -e "$mav0/state_groundtruth_estimate0/data.csv" ] || [ -e "$mav0/mocap0/data.csv" ] ||
    lacks="$lacks state_groundtruth_estimate0 or mocap0"
  if [ -n "$lacks" ]; then echo "real.sh: $name is left out: no$lacks" >&2; continue; fi
  sequences+=("$sequence")
  for file in "$folder"/trajectories/*/"$name".{tum,txt,csv}; do
    [ -e "$file" ] || continue
    arguments+=(--with "$(basename "$(dirname "$file")")@$name=$file")
  done
done < <(find -L "$folder" -type d -name mav0 -prune | sort)
[ ${#sequences[@]} -gt 0 ] ||
  fail "$folder: no sequence with images of two cameras, IMU and true poses; unpack the downloads"
echo "real.sh: ${#sequences[@]} sequences, $((${#arguments[@]} / 2)) trajectories of other systems" >&2

"$slcmap" compare "${sequences[@]}" -o "$out" ${arguments[@]+"${arguments[@]}"} "$@"
"$repository/tests/benchmarks/benchmark.py" "$out/compare.json" --real "$into"
echo "real.sh: written into $into; all figures in $out/report.html" >&2
