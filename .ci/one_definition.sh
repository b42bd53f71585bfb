#!/usr/bin/env bash
# For a release, as it takes half an hour: links the program once with the link-time optimiser, which
# sees all types at once, and fails where a type is defined in two ways (-Wodr). The test `house` looks
# at names alone. Nothing of it is shipped: it is compiled quickly, not well.
set -euo pipefail

cd "$(dirname "$0")/.."
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
cmake --preset odr "${launcher[@]}" >/dev/null
cmake --build --preset odr --target slcmap
