#!/usr/bin/env bash
# clang-tidy on sources: those given, or all that differ from a commit (`tidy.sh --since COMMIT`),
# or all. Needs a configured build/. A source takes some ten seconds.
set -euo pipefail

cd "$(dirname "$0")/.."
sources=("$@")
if [ $# = 0 ]; then
  mapfile -t sources < <(git ls-files {data,odometry,mapping,export,apps}/'*.cc')
elif [ "$1" = --since ]; then
  mapfile -t sources < <(git diff --name-only --diff-filter=d "$2" -- {data,odometry,mapping,export,apps}/'*.cc')
fi
flags=(-std=c++20 -I. -Ibuild/generated -DSLCMAP_SOURCE_DIR='"."')
# As the build has them: what is not ours is a system's.
for folder in $(grep -oh -- '-isystem [^ "]*' build/compile_commands.json | sort -u | cut -d' ' -f2); do
  flags+=(-isystem "$folder")
done
printf '%s\n' "${sources[@]}" |
  xargs -P "$(nproc)" -I{} clang-tidy --quiet {} -- "${flags[@]}"
