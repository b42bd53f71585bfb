#!/usr/bin/env bash
# Builds everything and runs the tests. Arguments go to ctest: tests/run.sh -R trajectory
set -euo pipefail

cd "$(dirname "$0")/.."
.ci/build.sh
ctest --preset release "$@"
