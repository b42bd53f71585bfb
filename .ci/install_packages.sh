#!/usr/bin/env bash
# Installs those packages of a list that are missing; says nothing when there are none. The list is
# packages.txt, or the file given.
set -euo pipefail

list=$(realpath "${1:-$(dirname "$0")/packages.txt}")
missing=()
for package in $(grep -v '^#' "$list"); do
  status=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
  # Where nodejs is not Debian's, npm is part of it, and Debian's would be in conflict with it.
  [ "$package" = npm ] && command -v npm >/dev/null && status=installed
  [ "$status" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
echo "Installing ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -qq --yes --no-install-recommends "${missing[@]}"
