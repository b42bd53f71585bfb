#!/usr/bin/env bash
# Builds everything and runs the tests; says at the end which cases were skipped, and why. Arguments
# go to ctest: tests/run.sh -R trajectory
set -euo pipefail

cd "$(dirname "$0")/.."
.ci/build.sh
status=0
ctest --preset release "$@" || status=$?
grep '^skipped: ' build/Testing/Temporary/LastTest.log || true
exit $status
