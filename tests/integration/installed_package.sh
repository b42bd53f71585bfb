#!/usr/bin/env bash
# Installs a build into a folder of its own, and builds and runs against the installed files alone:
# apps/examples, and a program that includes every installed header.
#
#   installed_package.sh BUILD CXX
set -euo pipefail

build=$1
cxx=$2
source=$(cd "$(dirname "$0")/../.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
prefix=$folder/prefix

quietly() {
  "$@" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
}
fail() {
  echo "$1"
  exit 1
}

quietly cmake --install "$build" --prefix "$prefix"
"$prefix/bin/slcmap" --version
page=share/slcmap/page/page.html
[ ! -e "$build/$page" ] || cmp "$build/$page" "$prefix/$page" || fail "the page is not installed"

# Copied, so that nothing of the sources beside it can be found.
cp -r "$source/apps/examples" "$folder/example"
quietly cmake -S "$folder/example" -B "$folder/example/build" -G Ninja \
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_PREFIX_PATH="$prefix"
quietly cmake --build "$folder/example/build"
"$folder/example/build/live" >"$folder/poses"
tail -n 3 "$folder/poses"
awk '/^#/ { next }
  { ++poses; error = $5 > $6 ? $5 - $6 : $6 - $5; if (error > worst) worst = error }
  END { print poses " poses, off by at most " worst " m"; exit !(poses > 80 && worst < 0.02) }' \
  "$folder/poses" || fail "expected more than 80 poses, each within 2 cm"
for example in read_map map_recording; do
  arguments=(nowhere map export)
  [ $example != read_map ] || arguments=(nowhere)
  ! "$folder/example/build/$example" "${arguments[@]}" 2>"$folder/log" || fail "$example reads nothing"
  grep -q nowhere "$folder/log" || fail "$example does not say what is missing"
done

# The whole package, with every header that it has.
mkdir "$folder/whole"
cp "$source/tests/integration/installed/CMakeLists.txt" "$folder/whole"
(cd "$prefix/include"/slcmap-* && find . -name '*.h' | sort | sed 's|^\./\(.*\)|#include "\1"|') \
  >"$folder/whole/headers"
headers=$(wc -l <"$folder/whole/headers")
[ "$headers" -gt 20 ] || fail "hardly any header is installed"
[ "$headers" -le 47 ] || fail "$headers headers are installed, expected those of the interface alone"
{
  cat "$folder/whole/headers"
  echo '#include <cstdio>'
  echo 'int main() {'
  echo '  const slcmap::MapResult map = slcmap::BuildMap({}, {});'
  echo '  std::printf("%zu formats, %zu points, version %s\n", slcmap::ExportFormats().size(),'
  echo '              map.points.size(), slcmap::kVersion);'
  echo '}'
} >"$folder/whole/main.cc"
quietly cmake -S "$folder/whole" -B "$folder/whole/build" -G Ninja \
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_PREFIX_PATH="$prefix"
quietly cmake --build "$folder/whole/build"
"$folder/whole/build/whole"
if grep -rqF "$source" "$prefix/lib/cmake" "$prefix/include"; then
  fail "installed files name the folder of the sources"
fi

# The Python module, where it is built.
modules=$prefix/lib/python3/dist-packages
if [ -d "$modules" ]; then
  (cd "$folder" && PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$modules /usr/bin/python3 -c \
    'import slcmap; print("module", slcmap.__version__, slcmap.Map.load.__doc__)')
fi

# The Debian packages hold the same, and their program runs.
quietly cpack -G DEB --config "$build/CPackConfig.cmake" -B "$folder/deb"
for package in "$folder"/deb/*.deb; do dpkg-deb -x "$package" "$folder/unpacked"; done
"$folder/unpacked/usr/bin/slcmap" --version
dpkg-deb -f "$folder"/deb/slcmap_*.deb Depends | grep -q libopencv ||
  fail "the package does not ask for the libraries of its program"
(cd "$prefix" && find . -type f | sort) >"$folder/installed"
(cd "$folder/unpacked/usr" && find . -type f | sort) | diff "$folder/installed" - ||
  fail "the packages hold other files than those that are installed"
