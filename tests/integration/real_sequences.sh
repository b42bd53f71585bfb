#!/usr/bin/env bash
# tests/benchmarks/real.sh on a real recording that is laid out as EuRoC and TUM VI are downloaded.
#
#   real_sequences.sh SLCMAP     exits with 77 where there is no recording
set -euo pipefail

source=$(cd "$(dirname "$0")/../.." && pwd)
recording=""
for shared in "${SLCMAP_SHARED:-}" "$source/../shared" "$source/../../shared"; do
  if [ -z "$recording" ] && [ -d "$shared/data/euroc_mh01_8s/mav0" ]; then
    recording=$(cd "$shared/data/euroc_mh01_8s/mav0" && pwd)
  fi
done
[ -n "$recording" ] || { echo "skipped: no shared/data/euroc_mh01_8s; set SLCMAP_SHARED"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() {
  echo "$1, found:"
  cat "$folder/BENCHMARK.md"
  exit 1
}

euroc=$folder/downloads/machine_hall/MH_01_easy
tumvi=$folder/downloads/dataset-corridor1_512_16
other=$folder/downloads/trajectories/other
mkdir -p "$euroc" "$tumvi/mav0/mocap0" "$tumvi/dso" "$other" "$folder/downloads/one_camera/mav0/cam0"
ln -s "$recording" "$euroc/mav0"
for sensor in cam0 cam1 imu0; do ln -s "$recording/$sensor" "$tumvi/mav0"; done
ln -s "$recording/state_groundtruth_estimate0/data.csv" "$tumvi/mav0/mocap0"
ln -s "$recording/state_groundtruth_estimate0/data.csv" "$other/MH_01_easy.csv"
printf '# Kept\n\ntext\n\n# EuRoC and TUM VI\n\nold\n\n# Behind\n' >"$folder/BENCHMARK.md"

"$source/tests/benchmarks/real.sh" "$folder/downloads" --out "$folder/out" --slcmap "$1" \
  --into "$folder/BENCHMARK.md" -- --methods points -q 2>"$folder/log" >/dev/null ||
  { cat "$folder/log"; exit 1; }
grep -q 'one_camera is left out: no cam1 imu0 state' "$folder/log" || fail "one camera is not left out"
[ "$(grep '^# ' "$folder/BENCHMARK.md" | tr '\n' '|')" = '# Kept|# EuRoC and TUM VI|# Behind|' ] ||
  fail "expected one chapter between the others"
! grep -q '^old' "$folder/BENCHMARK.md" || fail "expected no old figures"
grep -qF '| paper: MH_01_easy | 0.194 | - |' "$folder/BENCHMARK.md" || fail "expected the paper's row"
grep -qE '^\| MH_01_easy \| 0\.00[0-9] \| 0\.000 \|' "$folder/BENCHMARK.md" ||
  fail "expected errors of millimetres, and none of the true poses"
grep -qE '^\| mean of corridors \| 0\.00[0-9] \|' "$folder/BENCHMARK.md" ||
  fail "expected the mean of the corridors"
