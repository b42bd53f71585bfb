#!/usr/bin/env bash
# Fuzzes readers under the address and undefined-behaviour sanitizers, one after the other. Inputs
# that end a reader other than by an error of one line are left as finding-* in build-sanitize/.
#
#   tests/fuzz/run.sh SECONDS [NAME...]     of each; default: all targets
set -euo pipefail

cd "$(dirname "$0")/../.."
seconds=${1:?SECONDS is missing}
shift
names=("$@")
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
cmake --preset sanitize "${launcher[@]}" >/dev/null
cmake --build --preset sanitize --target fuzz

found=0
corpora=$PWD/tests/fuzz/corpus
cd build-sanitize
[ ${#names[@]} -gt 0 ] || mapfile -t names < <(tests/fuzz/fuzz)
for name in "${names[@]}"; do
  corpus=$corpora/$name
  [ -d "$corpus" ] || corpus=""
  tests/fuzz/fuzz "$name" "$seconds" "$corpus" "$(date +%s)" || found=1
done
exit $found
