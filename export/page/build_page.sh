#!/usr/bin/env bash
# Fetches what the page is made with, unless the lock file's packages are there already, and bundles
# it. Where that fails it says so and succeeds without the page: the rest can be built.
#
#   build_page.sh NPM NODE FOLDER OUTPUTS with-tests|without-tests
set -euo pipefail

npm=$1 node=$2 folder=$3 outputs=$4 tests=$5
source=$(cd "$(dirname "$0")" && pwd)
log=$folder/page.log

without_page() {
  echo "warning: $1, so \`slcmap view\` will have no page; $log says why" >&2
  rm -f "$outputs"/*.html
  exit 0
}

mkdir -p "$folder" "$outputs"
cd "$folder"
if ! cmp -s "$source/package-lock.json" installed.json || [ ! -e "installed-$tests" ]; then
  rm -f installed*
  cp "$source/package.json" "$source/package-lock.json" .
  omit=()
  [ "$tests" = with-tests ] || omit=(--omit=dev)
  "$npm" ci --ignore-scripts --no-audit --no-fund "${omit[@]}" >"$log" 2>&1 ||
    without_page "npm could not fetch the page's packages"
  cp package-lock.json installed.json
  touch "installed-$tests"
fi
"$node" "$source/bundle.mjs" node_modules "$outputs" >"$log" 2>&1 ||
  without_page "the page could not be bundled"
