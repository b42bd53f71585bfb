#!/usr/bin/env bash
# Times the page of a map with 100,000 lines, 1,000,000 points and 500 planes in headless Chromium,
# drawn by software; with --tiles that of a tileset with 1,000,000 lines and 50,000,000 points (which
# takes 5 GB of memory to make).
#
#   page_speed.sh BUILD [--tiles]
set -euo pipefail

build=$(cd "$1" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export SLCMAP_CHROMIUM SLCMAP_NODE_MODULES=$build/export/page/node_modules
SLCMAP_CHROMIUM=$(command -v chromium)
make_page=$build/tests/export/write_room_page
if [ "${2:-}" = --tiles ]; then
  "$make_page" "$build/share/slcmap/page/tiles.html" "$folder" 1000000 50000000 500 --tiles
  node "$here/tiles_speed.mjs" "$build/bin/slcmap" "$folder/tiles"
else
  "$make_page" "$build/share/slcmap/page/page.html" "$folder/large.html" 100000 1000000 500
  node "$here/page_speed.mjs" "$folder/large.html"
fi
