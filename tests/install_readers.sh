#!/usr/bin/env bash
# Installs the programs that tests read exported files back with: the Debian packages of
# readers/packages.txt, and the npm packages of readers/package.json into readers/node_modules.
# Without them their tests are skipped.
set -euo pipefail

cd "$(dirname "$0")"
../.ci/install_packages.sh readers/packages.txt
npm --prefix readers ci --no-audit --no-fund
