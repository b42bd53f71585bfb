#!/usr/bin/env bash
# Compares the walls of page, plans, IFC and OBJ of one building. Ends with 77 (skipped), saying what
# is missing, where there is no node or none of the page's packages.
#
#   same_walls.sh BUILD WRITE_WALLS
set -euo pipefail

build=$1
write_walls=$2
modules=$build/export/page/node_modules

skip() {
  echo "skipped: found no $1"
  exit 77
}
command -v node >/dev/null || skip "node"
command -v python3 >/dev/null || skip "python3"
[ -x "$modules/.bin/esbuild" ] || skip "esbuild in the build: it needs npm"

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
tests=$(cd "$(dirname "$0")" && pwd)
"$write_walls" "$folder"
NODE_PATH=$modules "$modules/.bin/esbuild" "$tests/read_page.mjs" --bundle --platform=node \
  --format=esm --outfile="$folder/read_page.mjs" --log-level=error
node "$folder/read_page.mjs" "$folder/page.txt" >"$folder/page.json"
python3 "$tests/same_walls.py" "$folder" "$folder/page.json"
