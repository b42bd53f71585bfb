#!/usr/bin/env bash
# Times the page of a map with 100,000 lines, 1,000,000 points and 500 planes in headless Chromium,
# drawn by software.
#
#   page_speed.sh BUILD
set -euo pipefail

build=$(cd "$1" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
modules=$build/export/page/node_modules
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

"$build/tests/export/write_room_page" "$build/share/slcmap/page/page.html" \
  "$folder/large.html" 100000 1000000 500
SLCMAP_CHROMIUM=$(command -v chromium) SLCMAP_NODE_MODULES=$modules \
  node "$here/page_speed.mjs" "$folder/large.html"
