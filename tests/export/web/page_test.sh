#!/usr/bin/env bash
# Runs distance_test.mjs, page_test.mjs and pictures_test.mjs on pages of a made room, and
# tiles_test.mjs on its tiles, which the program serves. Ends with 77 (skipped), saying what is
# missing, where there is no Chromium, no node or no page.
#
#   page_test.sh BUILD WRITE_ROOM_PAGE SLCMAP
set -euo pipefail

build=$1
write_room_page=$2
export SLCMAP_PROGRAM=$3
template=$build/share/slcmap/page/page.html
modules=$build/export/page/node_modules

skip() {
  echo "skipped: found no $1"
  exit 77
}
chromium=$(command -v chromium || command -v chromium-browser) || skip "chromium"
command -v node >/dev/null || skip "node"
[ -e "$template" ] || skip "page in the build: it needs npm"
[ -d "$modules/playwright-core" ] || skip "playwright-core in the build"

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
tests=$(cd "$(dirname "$0")" && pwd)
NODE_PATH=$modules "$modules/.bin/esbuild" "$tests/distance_test.mjs" --bundle --platform=node \
  --format=esm --outfile="$folder/distance_test.mjs" --log-level=error
node --test "$folder/distance_test.mjs"
"$write_room_page" "$template" "$folder/room.html"
"$write_room_page" "$template" "$folder/pictures.html" --images
export SLCMAP_CHROMIUM=$chromium SLCMAP_NODE_MODULES=$modules
SLCMAP_PAGE=$folder/room.html node --test "$tests/page_test.mjs"
SLCMAP_PAGE=$folder/pictures.html node --test "$tests/pictures_test.mjs"
mkdir "$folder/site"
"$write_room_page" "$(dirname "$template")/tiles.html" "$folder/site" --tiles
SLCMAP_TILES=$folder/site/tiles node --test "$tests/tiles_test.mjs"
