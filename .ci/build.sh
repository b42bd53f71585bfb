#!/usr/bin/env bash
# Configures and builds what is shipped, into build/. Arguments name targets; without any, all.
set -euo pipefail

cd "$(dirname "$0")/.."
.ci/install_packages.sh
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if ! cmake --preset release "${launcher[@]}" >"$log" 2>&1; then
  cat "$log" >&2
  exit 1
fi
targets=()
[ $# -eq 0 ] || targets=(--target "$@")
cmake --build --preset release "${targets[@]}"
