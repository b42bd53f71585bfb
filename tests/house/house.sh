#!/usr/bin/env bash
# The house keeps within its limits, and its code is formatted as .clang-format says. What is missing
# to check it is said, and the rest is checked.
set -euo pipefail

cd "$(dirname "$0")/../.."
status=0
if command -v python3 >/dev/null; then
  python3 tests/house/house.py . tests/house/limits.txt || status=1
else
  echo "skipped: limits of the house: no python3"
fi
# Other versions format otherwise; Debian 12 has 14.
if clang-format --version 2>/dev/null | grep -q 'version 14'; then
  find data odometry mapping export apps tests \( -name '*.cc' -o -name '*.h' \) -print0 |
    xargs -0 -n 50 clang-format --dry-run -Werror || status=1
else
  echo "skipped: format of the code: no clang-format 14"
fi
exit $status
